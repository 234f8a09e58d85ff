// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/motion_config.hpp"

#include "fabric_planner/pomdp.hpp"
#include "file.hpp"
#include "gesture_file.hpp"
#include "yaml_section.hpp"

namespace fabric::planner {
namespace {

constexpr int MOST_VIEWS = 100;

/// What the agent itself has to find, among names that are free.
void require(const yaml::Section& section, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (!section.has(name)) throw ModelError(section.place() + ": '" + name + "' is missing");
  }
}

void readPoses(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const auto poses = yaml::Section::named(root["poses"], name + ": poses");
  require(poses, {"home", "pick", "drop_back", "side"});
  for (const std::string& key : poses.names()) {
    if (key == TRAY || key == BACK) {
      throw ModelError(poses.placeOf(key) + ": the name has a meaning of its own in gestures");
    }
    config.poses[key] = poses.pose(key);
  }
}

void readTrays(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const YAML::Node trays = root["trays"];
  if (!trays || !trays.IsMap() || trays.size() == 0) {
    throw ModelError(name + ": trays: expected a map with at least one tray");
  }
  const auto section = yaml::Section::named(trays, name + ": trays");
  for (const std::string& label : section.names()) config.trays[label] = section.pose(label);
  config.inspection_tray = yaml::text(root, "inspection_tray", name);
  if (config.trays.count(config.inspection_tray) == 0) {
    throw ModelError(name + ": inspection_tray: there is no tray '" + config.inspection_tray + "'");
  }
}

void readSlots(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const YAML::Node slots = root["slots"];
  if (!slots || !slots.IsSequence() || slots.size() == 0) {
    throw ModelError(name + ": slots: expected a list with at least one slot");
  }
  for (const YAML::Node& entry : slots) {
    const std::string place = name + ": slots: " + std::to_string(config.slots.size() + 1);
    const yaml::Section slot(entry, place, {"x", "y"});
    config.slots.emplace_back(slot.number("x"), slot.number("y"));
  }
}

void readSpeeds(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const auto speeds = yaml::Section::named(root["speeds"], name + ": speeds");
  require(speeds, {"travel", "vertical"});
  for (const std::string& key : speeds.names()) config.speeds[key] = speeds.positive(key);
}

void readHeights(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const yaml::Section heights(root["heights"], name + ": heights", {"above_pick", "above_tray"});
  config.above_pick = heights.number("above_pick");
  config.above_tray = heights.number("above_tray");
  const auto check = [&name](const std::string& key, double height, const std::string& place,
                             double low) {
    if (height > low) return;
    throw ModelError(name + ": heights: " + key + ": " + std::to_string(height) + " is not above " +
                     place + " at " + std::to_string(low));
  };
  check("above_pick", config.above_pick, "pick", config.pick().z);
  check("above_pick", config.above_pick, "drop_back", config.dropBack().z);
  for (const auto& [label, pose] : config.trays)
    check("above_tray", config.above_tray, label, pose.z);
}

void readGestures(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const auto gestures = yaml::Section::named(root["gestures"], name + ": gestures");
  for (const std::string& key : gestures.names()) {
    const std::string place = gestures.placeOf(key);
    config.gestures[key] = readGesture(gestures.node(key), place, config);
    checkGesture(config.gestures[key], place);
  }
}

void readChosen(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  std::set<std::string> actions;
  for (const Action action : ALL_ACTIONS) actions.insert(actionName(action));
  const yaml::Section chosen(root["chosen"], name + ": chosen", actions);
  for (const Action action : ALL_ACTIONS) {
    const std::string key = actionName(action);
    const std::string gesture = chosen.text(key);
    const auto found = config.gestures.find(gesture);
    if (found == config.gestures.end()) {
      throw ModelError(chosen.placeOf(key) + ": there is no gesture '" + gesture + "'");
    }
    if (found->second.action != action) {
      throw ModelError(chosen.placeOf(key) + ": the gesture '" + gesture + "' stands for '" +
                       actionName(found->second.action) + "'");
    }
    config.chosen[action] = gesture;
  }
}

}  // namespace

MotionConfig MotionConfig::load(const std::string& path) { return parse(readFile(path), path); }

MotionConfig MotionConfig::parse(const std::string& text, const std::string& name) {
  const YAML::Node root = yaml::load(text, name);
  const yaml::Section file(root, name,
                           {"poses", "trays", "slots", "inspection_tray", "heights", "speeds",
                            "gestures", "chosen", "lost_after"});
  MotionConfig config;
  readPoses(root, name, config);
  readTrays(root, name, config);
  readSlots(root, name, config);
  readHeights(root, name, config);
  readSpeeds(root, name, config);
  readGestures(root, name, config);
  readChosen(root, name, config);
  config.lost_after = file.count("lost_after", MOST_VIEWS);
  return config;
}

const Gesture& MotionConfig::gesture(Action action, const std::string& name) const {
  const auto found = gestures.find(name.empty() ? chosen.at(action) : name);
  if (found != gestures.end()) return found->second;
  std::string known;
  for (const auto& [key, gesture] : gestures) known += (known.empty() ? "" : ", ") + key;
  throw ModelError("there is no gesture '" + name + "'; known: " + known);
}

ToolPose MotionConfig::slot(const std::string& label, unsigned count) const {
  const auto& [dx, dy] = slots[count % slots.size()];
  ToolPose pose = trays.at(label);
  pose.x += dx;
  pose.y += dy;
  return pose;
}

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/motion_config.hpp"

#include <cmath>

#include "fabric_planner/pomdp.hpp"
#include "file.hpp"
#include "yaml.hpp"

namespace fabric::planner {
namespace {

/// One map of the file; every entry read is checked and named in errors.
class Section {
 public:
  Section(const YAML::Node& node, std::string place, const std::set<std::string>& names)
      : node_(node), place_(std::move(place)) {
    yaml::checkMap(node_, place_, names);
  }

  [[nodiscard]] double number(const std::string& key) const {
    return yaml::number(node_[key], place_ + ": " + key);
  }

  [[nodiscard]] double positive(const std::string& key) const {
    const double value = number(key);
    if (value > 0.0) return value;
    throw ModelError(place_ + ": " + key + ": " + std::to_string(value) + " is not positive");
  }

  [[nodiscard]] ToolPose pose(const std::string& key) const {
    const Section entry(node_[key], place_ + ": " + key, {"x", "y", "z", "yaw"});
    return {entry.number("x"), entry.number("y"), entry.number("z"), entry.number("yaw")};
  }

 private:
  YAML::Node node_;
  std::string place_;
};

void readPoses(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const Section poses(root["poses"], name + ": poses",
                      {"home", "planning", "pick", "drop_back", "side", "attention", "point"});
  config.home = poses.pose("home");
  config.planning = poses.pose("planning");
  config.pick = poses.pose("pick");
  config.drop_back = poses.pose("drop_back");
  config.side = poses.pose("side");
  config.attention = poses.pose("attention");
  config.point = poses.pose("point");
}

void readTrays(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const YAML::Node trays = root["trays"];
  if (!trays || !trays.IsMap() || trays.size() == 0) {
    throw ModelError(name + ": trays: expected a map with at least one tray");
  }
  std::set<std::string> labels;
  for (const auto& entry : trays) labels.insert(entry.first.as<std::string>());
  const Section section(trays, name + ": trays", labels);
  for (const std::string& label : labels) config.trays[label] = section.pose(label);
  config.inspection_tray = yaml::text(root, "inspection_tray", name);
  if (labels.count(config.inspection_tray) == 0) {
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
    const Section slot(entry, place, {"x", "y"});
    config.slots.emplace_back(slot.number("x"), slot.number("y"));
  }
}

void readPace(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const Section speeds(root["speeds"], name + ": speeds",
                       {"travel", "vertical", "gesture", "withdraw"});
  config.travel_speed = speeds.positive("travel");
  config.vertical_speed = speeds.positive("vertical");
  config.gesture_speed = speeds.positive("gesture");
  config.withdraw_speed = speeds.positive("withdraw");
  const Section times(root["times"], name + ": times", {"plan", "grip", "release"});
  config.plan_time = times.positive("plan");
  config.grip_time = times.positive("grip");
  config.release_time = times.positive("release");
}

void readGesture(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const Section gesture(root["gesture"], name + ": gesture", {"nods", "depth"});
  config.nod_depth = gesture.positive("depth");
  const double nods = gesture.positive("nods");
  if (nods != std::floor(nods) || nods > 10.0) {
    throw ModelError(name + ": gesture: nods: " + std::to_string(nods) +
                     " is not a whole number up to 10");
  }
  config.nods = static_cast<int>(nods);
}

void readHeights(const YAML::Node& root, const std::string& name, MotionConfig& config) {
  const Section heights(root["heights"], name + ": heights", {"above_pick", "above_tray"});
  config.above_pick = heights.number("above_pick");
  config.above_tray = heights.number("above_tray");
  const auto check = [&name](const std::string& key, double height, const std::string& place,
                             double low) {
    if (height > low) return;
    throw ModelError(name + ": heights: " + key + ": " + std::to_string(height) + " is not above " +
                     place + " at " + std::to_string(low));
  };
  check("above_pick", config.above_pick, "pick", config.pick.z);
  check("above_pick", config.above_pick, "drop_back", config.drop_back.z);
  for (const auto& [label, pose] : config.trays)
    check("above_tray", config.above_tray, label, pose.z);
}

}  // namespace

MotionConfig MotionConfig::load(const std::string& path) { return parse(readFile(path), path); }

MotionConfig MotionConfig::parse(const std::string& text, const std::string& name) {
  const YAML::Node root = yaml::load(text, name);
  yaml::checkMap(
      root, name,
      {"poses", "trays", "slots", "inspection_tray", "heights", "speeds", "times", "gesture"});
  MotionConfig config;
  readPoses(root, name, config);
  readTrays(root, name, config);
  readSlots(root, name, config);
  readHeights(root, name, config);
  readPace(root, name, config);
  readGesture(root, name, config);
  return config;
}

ToolPose MotionConfig::slot(const std::string& label, unsigned count) const {
  const auto& [dx, dy] = slots[count % slots.size()];
  ToolPose pose = trays.at(label);
  pose.x += dx;
  pose.y += dy;
  return pose;
}

}  // namespace fabric::planner

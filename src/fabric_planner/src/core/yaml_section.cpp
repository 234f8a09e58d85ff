// SPDX-License-Identifier: BSD-3-Clause
#include "yaml_section.hpp"

#include <cmath>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner::yaml {
namespace {

std::set<std::string> keysOf(const YAML::Node& node, const std::string& place) {
  if (!node || !node.IsMap() || node.size() == 0) {
    throw ModelError(place + ": expected a map with at least one entry");
  }
  std::set<std::string> keys;
  for (const auto& entry : node) {
    if (!entry.first.IsScalar()) throw ModelError(place + ": an entry has no name");
    keys.insert(entry.first.Scalar());
  }
  return keys;
}

}  // namespace

Section::Section(const YAML::Node& node, std::string place, const std::set<std::string>& names)
    : node_(node), place_(std::move(place)) {
  checkMap(node_, place_, names);
}

Section Section::named(const YAML::Node& node, const std::string& place) {
  return {node, place, keysOf(node, place)};
}

std::set<std::string> Section::names() const { return keysOf(node_, place_); }

double Section::number(const std::string& key) const {
  return yaml::number(node_[key], placeOf(key));
}

double Section::positive(const std::string& key) const {
  const double value = number(key);
  if (value > 0.0) return value;
  throw ModelError(placeOf(key) + ": " + std::to_string(value) + " is not positive");
}

double Section::atLeastZero(const std::string& key) const {
  const double value = number(key);
  if (value >= 0.0) return value;
  throw ModelError(placeOf(key) + ": " + std::to_string(value) + " is negative");
}

int Section::count(const std::string& key, int most) const {
  const double value = number(key);
  if (value >= 1.0 && value <= most && value == std::floor(value)) return static_cast<int>(value);
  throw ModelError(placeOf(key) + ": " + std::to_string(value) +
                   " is not a whole number from 1 to " + std::to_string(most));
}

std::string Section::text(const std::string& key) const { return yaml::text(node_, key, place_); }

ToolPose Section::pose(const std::string& key) const {
  const Section entry(node_[key], placeOf(key), {"x", "y", "z", "yaw"});
  return {entry.number("x"), entry.number("y"), entry.number("z"), entry.number("yaw")};
}

}  // namespace fabric::planner::yaml

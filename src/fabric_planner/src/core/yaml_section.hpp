// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>
#include <string>

#include "fabric_planner/gesture.hpp"
#include "yaml.hpp"

namespace fabric::planner::yaml {

/// One map of a file; every entry read is checked and named in errors (ModelError).
class Section {
 public:
  Section(const YAML::Node& node, std::string place, const std::set<std::string>& names);
  /// With names of its own choosing; at least one.
  static Section named(const YAML::Node& node, const std::string& place);

  [[nodiscard]] const std::string& place() const { return place_; }
  [[nodiscard]] std::set<std::string> names() const;
  [[nodiscard]] bool has(const std::string& key) const { return static_cast<bool>(node_[key]); }
  [[nodiscard]] YAML::Node node(const std::string& key) const { return node_[key]; }
  [[nodiscard]] std::string placeOf(const std::string& key) const { return place_ + ": " + key; }

  [[nodiscard]] double number(const std::string& key) const;
  [[nodiscard]] double positive(const std::string& key) const;
  /// Not negative.
  [[nodiscard]] double atLeastZero(const std::string& key) const;
  /// A whole number from 1 to `most`.
  [[nodiscard]] int count(const std::string& key, int most) const;
  [[nodiscard]] std::string text(const std::string& key) const;
  [[nodiscard]] ToolPose pose(const std::string& key) const;

 private:
  YAML::Node node_;
  std::string place_;
};

}  // namespace fabric::planner::yaml

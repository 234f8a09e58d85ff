// SPDX-License-Identifier: BSD-3-Clause
#include "yaml.hpp"

#include <cmath>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner::yaml {
namespace {

std::string shown(const YAML::Node& node) {
  if (!node || node.IsNull()) return "nothing";
  return node.IsScalar() ? "'" + node.Scalar() + "'" : "a list or map";
}

std::string listed(const std::set<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

}  // namespace

YAML::Node load(const std::string& text, const std::string& name) {
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw ModelError(name + ": " + error.what());
  }
}

void checkMap(const YAML::Node& node, const std::string& place,
              const std::set<std::string>& allowed) {
  if (!node || !node.IsMap()) throw ModelError(place + ": expected a map, got " + shown(node));
  std::set<std::string> seen;
  for (const auto& entry : node) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "(no name)";
    if (allowed.count(key) == 0) {
      throw ModelError(place + ": unknown name '" + key + "'; known: " + listed(allowed));
    }
    if (!seen.insert(key).second) throw ModelError(place + ": '" + key + "' given twice");
  }
}

std::string text(const YAML::Node& map, const std::string& key, const std::string& place) {
  const YAML::Node node = map[key];
  if (!node || !node.IsScalar()) {
    throw ModelError(place + ": " + key + ": expected a name, got " + shown(node));
  }
  return node.Scalar();
}

bool boolean(const YAML::Node& node, const std::string& place) {
  bool value = false;
  if (!node.IsScalar() || !YAML::convert<bool>::decode(node, value)) {
    throw ModelError(place + ": expected true or false, got " + shown(node));
  }
  return value;
}

double number(const YAML::Node& node, const std::string& place) {
  double value = 0.0;
  if (!node || !node.IsScalar() || !YAML::convert<double>::decode(node, value)) {
    throw ModelError(place + ": expected a number, got " + shown(node));
  }
  if (std::isnan(value)) throw ModelError(place + ": is NaN");
  if (std::isinf(value)) throw ModelError(place + ": is infinite");
  return value;
}

}  // namespace fabric::planner::yaml

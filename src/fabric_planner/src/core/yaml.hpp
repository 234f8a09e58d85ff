// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <set>
#include <string>

namespace fabric::planner::yaml {

/// The only document of a text; `name` begins every error message. @throw ModelError with the line.
YAML::Node load(const std::string& text, const std::string& name);

/// Refuses anything but a map with keys out of `allowed`, each once; `place` begins the message.
void checkMap(const YAML::Node& node, const std::string& place,
              const std::set<std::string>& allowed);

/// The scalar under `key`. @throw ModelError when it is missing or not one of that type.
std::string text(const YAML::Node& map, const std::string& key, const std::string& place);
bool boolean(const YAML::Node& node, const std::string& place);
/// A finite number. @throw ModelError also for NaN and infinity, by name.
double number(const YAML::Node& node, const std::string& place);

}  // namespace fabric::planner::yaml

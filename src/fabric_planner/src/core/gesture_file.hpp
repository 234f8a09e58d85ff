// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fabric_planner/motion_config.hpp"
#include "yaml_section.hpp"

namespace fabric::planner {

/// Reads the gesture under `node`; the poses and speeds of `config` are known already.
/// @throw ModelError beginning with `place`: unknown names, numbers that make no sense
Gesture readGesture(const YAML::Node& node, const std::string& place, const MotionConfig& config);

/// Refuses what would hit something, and what does not do what its action is for.
/// @throw ModelError beginning with `place`
void checkGesture(const Gesture& gesture, const std::string& place);

}  // namespace fabric::planner

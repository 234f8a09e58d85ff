// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace fabric::planner {

/// The robot's five actions, numbered as in fabric_msgs/Decision.
enum class Action : std::uint8_t { IDLE = 0, PLANNING = 1, POINT = 2, GRASP = 3, CANCEL = 4 };

inline constexpr std::array<Action, 5> ALL_ACTIONS = {Action::IDLE, Action::PLANNING, Action::POINT,
                                                      Action::GRASP, Action::CANCEL};

/// idle, planning, point, grasp or cancel.
std::string actionName(Action action);

/// The action that a model calls `name`: the five names above, or one of the names used by models
/// and recordings of the original project. Capitals, blanks, '_' and '-' make no difference.
/// @throw ModelError naming the allowed ones.
Action actionFromName(const std::string& name);

/// The action with this number. @throw ModelError when there is none.
Action actionFromNumber(int number);

}  // namespace fabric::planner

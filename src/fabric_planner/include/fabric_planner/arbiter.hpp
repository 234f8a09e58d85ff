// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include "fabric_planner/actions.hpp"

namespace fabric::planner {

/// What becomes of a new action.
enum class Verdict {
  START,     ///< nothing runs: it starts
  CONTINUE,  ///< it runs already
  PRE_EMPT,  ///< it displaces the running action
  QUEUE,     ///< it starts when the running action has ended
};

/// One row of Table 6.5. Priority 1 is the highest.
struct ActionRule {
  Action action;
  int priority;
  int pre_empts_from;  ///< displaces running actions of this priority and lower
  int blocked_from;    ///< while it runs, actions of this priority and lower have to wait
};

/// "Displaces nothing", "lets nothing wait that could displace it".
inline constexpr int NO_PRIORITY = 4;

/// Table 6.5, prioritization of robot actions. Where two of its rows disagree the row of the
/// running action decides: pointing is short, so a grasp waits for its end.
inline constexpr std::array<ActionRule, 5> TABLE_6_5 = {{
    {Action::CANCEL, 1, 1, 1},              // not pre-emptable; displaces all other actions
    {Action::GRASP, 2, 3, 2},               // only cancel displaces it; displaces lower priorities
    {Action::PLANNING, 2, NO_PRIORITY, 3},  // displaces nothing, blocks priority 3
    {Action::POINT, 3, NO_PRIORITY, 2},     // displaces nothing, blocks priorities 2 and 3
    {Action::IDLE, 3, NO_PRIORITY, NO_PRIORITY},  // displaces nothing
}};

/// What becomes of `next` while `running` runs (Table 6.5). Whatever does not displace waits as the
/// next action (thesis 6.2.3.1); the newest one waiting replaces the one before.
Verdict arbitrate(std::optional<Action> running, Action next);

}  // namespace fabric::planner

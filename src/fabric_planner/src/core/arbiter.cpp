// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/arbiter.hpp"

#include <algorithm>

namespace fabric::planner {
namespace {

const ActionRule& ruleOf(Action action) {
  return *std::find_if(TABLE_6_5.begin(), TABLE_6_5.end(),
                       [action](const ActionRule& rule) { return rule.action == action; });
}

}  // namespace

Verdict arbitrate(std::optional<Action> running, Action next) {
  if (!running) return Verdict::START;
  if (*running == next) return Verdict::CONTINUE;
  const ActionRule& now = ruleOf(*running);
  const ActionRule& wanted = ruleOf(next);
  const bool displaces = now.priority >= wanted.pre_empts_from;
  const bool blocked = wanted.priority >= now.blocked_from;
  return displaces && !blocked ? Verdict::PRE_EMPT : Verdict::QUEUE;
}

}  // namespace fabric::planner

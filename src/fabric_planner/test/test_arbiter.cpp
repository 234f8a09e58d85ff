// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "fabric_planner/arbiter.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {
namespace {

using A = Action;
using V = Verdict;

// Every ordered pair of running and new action, worked out by hand from Table 6.5.
const std::map<std::pair<A, A>, V> EXPECTED = {
    {{A::IDLE, A::IDLE}, V::CONTINUE},       {{A::IDLE, A::PLANNING}, V::QUEUE},
    {{A::IDLE, A::POINT}, V::QUEUE},         {{A::IDLE, A::GRASP}, V::PRE_EMPT},
    {{A::IDLE, A::CANCEL}, V::PRE_EMPT},

    {{A::PLANNING, A::IDLE}, V::QUEUE},      {{A::PLANNING, A::PLANNING}, V::CONTINUE},
    {{A::PLANNING, A::POINT}, V::QUEUE},     {{A::PLANNING, A::GRASP}, V::QUEUE},
    {{A::PLANNING, A::CANCEL}, V::PRE_EMPT},

    {{A::POINT, A::IDLE}, V::QUEUE},         {{A::POINT, A::PLANNING}, V::QUEUE},
    {{A::POINT, A::POINT}, V::CONTINUE},     {{A::POINT, A::GRASP}, V::QUEUE},
    {{A::POINT, A::CANCEL}, V::PRE_EMPT},

    {{A::GRASP, A::IDLE}, V::QUEUE},         {{A::GRASP, A::PLANNING}, V::QUEUE},
    {{A::GRASP, A::POINT}, V::QUEUE},        {{A::GRASP, A::GRASP}, V::CONTINUE},
    {{A::GRASP, A::CANCEL}, V::PRE_EMPT},

    {{A::CANCEL, A::IDLE}, V::QUEUE},        {{A::CANCEL, A::PLANNING}, V::QUEUE},
    {{A::CANCEL, A::POINT}, V::QUEUE},       {{A::CANCEL, A::GRASP}, V::QUEUE},
    {{A::CANCEL, A::CANCEL}, V::CONTINUE},
};

TEST(Arbiter, DecidesEveryPairAsInTable65) {
  ASSERT_EQ(EXPECTED.size(), ALL_ACTIONS.size() * ALL_ACTIONS.size());
  for (const auto& [pair, verdict] : EXPECTED) {
    EXPECT_EQ(arbitrate(pair.first, pair.second), verdict)
        << actionName(pair.first) << " running, " << actionName(pair.second) << " new";
  }
}

TEST(Arbiter, StartsAnythingWhenNothingRuns) {
  for (const A action : ALL_ACTIONS) EXPECT_EQ(arbitrate(std::nullopt, action), V::START);
}

TEST(Arbiter, LetsNothingDisplaceCancel) {
  for (const A action : ALL_ACTIONS) EXPECT_NE(arbitrate(A::CANCEL, action), V::PRE_EMPT);
}

TEST(Actions, HaveTheNamesOfOriginalModelsToo) {
  EXPECT_EQ(actionFromName("graspPlanning"), A::PLANNING);
  EXPECT_EQ(actionFromName("planning for grasping"), A::PLANNING);
  EXPECT_EQ(actionFromName("point to remind human"), A::POINT);
  EXPECT_EQ(actionFromName("cancel all actions"), A::CANCEL);
  for (const A action : ALL_ACTIONS) {
    EXPECT_EQ(actionFromName(actionName(action)), action);
    EXPECT_EQ(actionFromNumber(static_cast<int>(action)), action);
  }
}

TEST(Actions, RefuseOtherNamesAndNumbers) {
  EXPECT_THROW(actionFromName("dance"), ModelError);
  EXPECT_THROW(actionFromNumber(5), ModelError);
  EXPECT_THROW(actionFromNumber(-1), ModelError);
}

}  // namespace
}  // namespace fabric::planner

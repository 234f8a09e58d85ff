// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/generative.hpp"

#include <cmath>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner::generative {
namespace {

void refuse(const std::string& what, double value, const std::string& expected) {
  throw ModelError("generative model: " + what + " is " + std::to_string(value) + ", expected " +
                   expected);
}

}  // namespace

void checkNumbers(int actions, double discount, std::size_t names, RewardRange range) {
  if (actions < 1) refuse("numActions", actions, "at least 1");
  if (names != static_cast<std::size_t>(actions)) {
    refuse("the number of action names", static_cast<double>(names),
           "one for each of the " + std::to_string(actions) + " actions");
  }
  if (!(discount > 0.0 && discount < 1.0)) refuse("discount", discount, "0 < discount < 1");
  if (!std::isfinite(range.low)) refuse("rewardRange.low", range.low, "a finite number");
  if (!std::isfinite(range.high)) refuse("rewardRange.high", range.high, "a finite number");
  if (range.low > range.high) {
    refuse("rewardRange.low", range.low, "at most high, " + std::to_string(range.high));
  }
}

void checkParticles(int particles, int recovery_tries) {
  if (particles < 1) refuse("option particles", particles, "at least 1");
  if (recovery_tries < 0) refuse("option recovery_tries", recovery_tries, "at least 0");
}

}  // namespace fabric::planner::generative

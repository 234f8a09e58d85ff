// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fabric_planner/generative.hpp"
#include "fabric_planner/random.hpp"

namespace fabric::planner::examples {

/// Tiger (Kaelbling, Littman & Cassandra, Artificial Intelligence 101, 1998): behind one of two
/// doors waits a tiger, behind the other a reward.
///
/// Actions: listen (-1; tells the right side with probability 0.85), open_left and open_right
/// (-100 where the tiger is, else +10; then the tiger is placed anew, both sides alike, and the
/// observation says nothing). Discount 0.95; never ends. Optimal value of the initial
/// belief: 19.37.
class Tiger {
 public:
  using State = std::uint8_t;  ///< LEFT or RIGHT: where the tiger is; observations alike
  static constexpr State LEFT = 0;
  static constexpr State RIGHT = 1;
  static constexpr int LISTEN = 0;
  static constexpr int OPEN_LEFT = 1;
  static constexpr int OPEN_RIGHT = 2;

  [[nodiscard]] int numActions() const { return 3; }
  [[nodiscard]] double discount() const { return 0.95; }
  [[nodiscard]] std::vector<std::string> actionNames() const {
    return {"listen", "open_left", "open_right"};
  }
  [[nodiscard]] RewardRange rewardRange() const { return {-100.0, 10.0}; }
  [[nodiscard]] State initialState(Random& random) const {
    return random.uniform() < 0.5 ? LEFT : RIGHT;
  }
  Step step(State& state, int action, double u) const {
    if (action == LISTEN) {
      return {-1.0, static_cast<Observation>(u < 0.85 ? state : 1 - state), false};
    }
    const double reward = action - OPEN_LEFT == state ? -100.0 : 10.0;
    state = u < 0.5 ? LEFT : RIGHT;
    const double rest = u < 0.5 ? 2.0 * u : 2.0 * u - 1.0;
    return {reward, rest < 0.5 ? Observation{LEFT} : Observation{RIGHT}, false};
  }
  [[nodiscard]] double observationProbability(const State& next, int action,
                                              Observation observation) const {
    if (observation > RIGHT) return 0.0;
    if (action != LISTEN) return 0.5;
    return observation == next ? 0.85 : 0.15;
  }
  /// With the tiger seen at every step, the other door pays 10 for ever.
  [[nodiscard]] double upperBound(const State& /*state*/) const { return 10.0 / (1.0 - 0.95); }
  void addUpperBounds(const State& state, double* sums) const {
    const double later = discount() * upperBound(state);
    sums[LISTEN] += -1.0 + later;
    sums[OPEN_LEFT] += (state == LEFT ? -100.0 : 10.0) + later;
    sums[OPEN_RIGHT] += (state == RIGHT ? -100.0 : 10.0) + later;
  }
  [[nodiscard]] int defaultAction(const State* /*states*/, int /*count*/) const { return LISTEN; }
  [[nodiscard]] double lowerBoundAtHorizon(const State& /*state*/) const {
    return -1.0 / (1.0 - discount());
  }
};

}  // namespace fabric::planner::examples

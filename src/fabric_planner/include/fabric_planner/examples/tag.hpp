// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fabric_planner/generative.hpp"
#include "fabric_planner/particle_belief.hpp"

namespace fabric::planner::examples {

/// Tag (Pineau, Gordon & Thrun 2003): a robot hunts an opponent it sees only in its own cell.
///
///     . . . . . # # # . .        29 cells: two rows of 10, and 3 x 3 above columns 5 to 7
///
/// * 870 states: robot cell x opponent cell, and the end (no state here); 5 actions; 30
///   observations: the robot's cell, or "same cell"; discount 0.95.
/// * north, east, south, west: -1, the robot moves unless a wall is there.
/// * tag: +10 and the end when both share the cell, else -10.
/// * The opponent knows where the robot is before it moves. With probability 0.4 it moves away
///   along each axis (on an axis where both are level 0.2 to either side), with 0.2 it stays; a
///   wall keeps it where it is. It moves during a failed tag too.
/// * At first robot and opponent are anywhere, independently; the robot does not know its cell.
///
/// Upper bound: fast informed bound, solved when the model is made. Default policy: goes
/// where the opponent is likely and near, and tags it when it is seen; its value is found by moving
/// the distribution over the opponent's cells, not by simulation. Belief: exact.
class Tag {
 public:
  static constexpr int CELLS = 29;
  static constexpr int TAG = 4;  ///< the action; 0 to 3 move
  static constexpr int ACTIONS = 5;
  static constexpr Observation SAME = CELLS;

  struct State {
    std::uint8_t robot;
    std::uint8_t opponent;
  };

  Tag();

  [[nodiscard]] int numActions() const { return ACTIONS; }
  [[nodiscard]] double discount() const { return 0.95; }
  [[nodiscard]] std::vector<std::string> actionNames() const;
  [[nodiscard]] RewardRange rewardRange() const { return {-10.0, 10.0}; }
  State initialState(Random& random) const {
    return {static_cast<std::uint8_t>(random.below(CELLS)),
            static_cast<std::uint8_t>(random.below(CELLS))};
  }
  Step step(State& state, int action, double u) const {
    const bool same = state.robot == state.opponent;
    if (action == TAG && same) return {10.0, SAME, true};
    const std::uint8_t robot = next_[state.robot][static_cast<std::size_t>(action)];
    state.opponent = flight_[state.robot][state.opponent][static_cast<std::size_t>(u * FLIGHTS)];
    state.robot = robot;
    return {action == TAG ? -10.0 : -1.0, observe(state), false};
  }
  double observationProbability(const State& next, int /*action*/, Observation o) const {
    return o == observe(next) ? 1.0 : 0.0;
  }
  double upperBound(const State& state) const;
  void addUpperBounds(const State& state, double* sums) const {
    const auto& bounds = upper_[index(state)];
    for (int a = 0; a < ACTIONS; ++a) sums[a] += bounds[static_cast<std::size_t>(a)];
  }
  int defaultAction(const State* states, int count) const;
  /// The default policy's value in the model, from the distribution of the states.
  LowerBound lowerBound(const State* states, int count) const;
  std::unique_ptr<Belief<State>> makeBelief(std::uint64_t seed) const;

  static Observation observe(const State& state) {
    return state.robot == state.opponent ? SAME : state.robot;
  }
  static std::size_t index(const State& state) {
    return static_cast<std::size_t>(state.robot) * CELLS + state.opponent;
  }

 private:
  static constexpr int FLIGHTS = 5;
  static constexpr int PADDED = 32;
  using Cells = std::array<float, PADDED>;  // a distribution over the opponent's cells

  [[nodiscard]] double chase(int robot, Cells cells, double mass) const;
  [[nodiscard]] double chaseUnknown(const State* states, int count) const;
  void layOut();
  void findDistances();
  void solve();
  [[nodiscard]] double backUp(const State& state, int action) const;

  std::array<std::array<std::uint8_t, ACTIONS>, CELLS> next_{};  // robot cell after an action
  std::array<std::array<std::array<std::uint8_t, FLIGHTS>, CELLS>, CELLS> flight_{};
  std::array<std::array<std::uint8_t, CELLS>, CELLS> towards_{};  // first move of a shortest way
  std::array<Cells, CELLS> reach_{};             // by robot and cell: what a cell is worth going to
  std::vector<std::array<Cells, CELLS>> moves_;  // P(opponent' | robot, opponent)
  std::array<std::array<float, ACTIONS>, CELLS * CELLS> upper_{};  // fast informed bound
};

}  // namespace fabric::planner::examples

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

/// RockSample(n, k) (Smith & Simmons 2004): a rover on n x n cells with k rocks, good or bad.
///
/// * n^2 2^k states and the end; 5 + k actions; 3 observations: none, bad, good; discount 0.95.
/// * north, east, south, west: 0; east from the last column: +10 and the end.
/// * sample, on a rock: +10 and the rock turns bad when it was good, else -10.
/// * check i: 0; says good or bad of rock i, rightly with probability (1 + 2^(-d / 20)) / 2 at
///   Euclidean distance d (half efficiency distance 20).
/// * Moves off the other edges and samples of bare ground cost -100 and change nothing; legal()
///   rules them out.
/// * At first the rover is in the middle of the first column, and each rock is good with
///   probability 1/2.
///
/// RockSample(7, 8) and (11, 11) have the layouts of the literature; all others are drawn from
/// (n, k).
///
/// Upper bound: all rocks known. Lower bound: a tour over the promising rocks, each checked on the
/// spot unless it is nearly sure, then the exit. Both come from a table of the best tour for
/// every set of good rocks and every cell, made with the model (3 bytes n^2 2^k). Belief: exact,
/// since rocks stay independent.
class RockSample {
 public:
  static constexpr int MAX_ROCKS = 16;
  static constexpr int NORTH = 0;
  static constexpr int EAST = 1;
  static constexpr int SOUTH = 2;
  static constexpr int WEST = 3;
  static constexpr int SAMPLE = 4;
  static constexpr int CHECK = 5;  ///< of rock 0; the others follow
  static constexpr Observation NONE = 0;
  static constexpr Observation BAD = 1;
  static constexpr Observation GOOD = 2;

  struct State {
    std::uint16_t cell;   ///< x + n y
    std::uint16_t rocks;  ///< bit i: rock i is good
  };

  /// @param n 2 to 32. @param k 1 to 16, at most n^2. @throw ModelError when out of range.
  RockSample(int n, int k);

  [[nodiscard]] int size() const { return n_; }
  [[nodiscard]] int rocks() const { return k_; }
  [[nodiscard]] int rockCell(int rock) const { return rock_cells_[rock]; }
  [[nodiscard]] int startCell() const { return n_ * (n_ / 2); }
  /// Probability that a check from a cell is right.
  [[nodiscard]] double accuracy(int cell, int rock) const {
    return accuracy_[static_cast<std::size_t>(cell * k_ + rock)];
  }

  [[nodiscard]] int numActions() const { return CHECK + k_; }
  [[nodiscard]] double discount() const { return 0.95; }
  [[nodiscard]] std::vector<std::string> actionNames() const;
  [[nodiscard]] RewardRange rewardRange() const { return {-100.0, 10.0}; }
  State initialState(Random& random) const {
    return {static_cast<std::uint16_t>(startCell()),
            static_cast<std::uint16_t>(random.bits() >> (64 - k_))};
  }
  Step step(State& state, int action, double u) const {
    if (action >= CHECK) {
      const bool good = ((state.rocks >> (action - CHECK)) & 1) != 0;
      const bool right = u < accuracy(state.cell, action - CHECK);
      return {0.0, good == right ? GOOD : BAD, false};
    }
    if (action == SAMPLE) return sample(state);
    const int to = next_[state.cell][static_cast<std::size_t>(action)];
    if (to == EXIT) return {10.0, NONE, true};
    if (to == WALL) return {-100.0, NONE, false};
    state.cell = static_cast<std::uint16_t>(to);
    return {0.0, NONE, false};
  }
  double observationProbability(const State& next, int action, Observation o) const {
    if (action < CHECK || o == NONE) return (action < CHECK) == (o == NONE) ? 1.0 : 0.0;
    const bool good = ((next.rocks >> (action - CHECK)) & 1) != 0;
    const double right = accuracy(next.cell, action - CHECK);
    return good == (o == GOOD) ? right : 1.0 - right;
  }
  bool legal(const State& state, int action) const {
    if (action >= CHECK) return true;
    if (action == SAMPLE) return rock_at_[state.cell] >= 0;
    return next_[state.cell][static_cast<std::size_t>(action)] != WALL;
  }
  double upperBound(const State& state) const { return known(state.cell, state.rocks); }
  void addUpperBounds(const State& state, double* sums) const;
  LowerBound lowerBound(const State* states, int count) const;
  std::unique_ptr<Belief<State>> makeBelief(std::uint64_t seed) const;

  /// The best value when all rocks are known, rounded up to 1/256.
  [[nodiscard]] double known(int cell, int rocks) const {
    return UNIT * known_[static_cast<std::size_t>(rocks) * cells_ + cell];
  }

 private:
  static constexpr int EXIT = -1;
  static constexpr int WALL = -2;
  static constexpr double UNIT = 1.0 / 256.0;
  using Chances = std::array<double, MAX_ROCKS>;

  Step sample(State& state) const {
    const int rock = rock_at_[state.cell];
    if (rock < 0) return {-100.0, NONE, false};
    const bool good = ((state.rocks >> rock) & 1) != 0;
    state.rocks &= static_cast<std::uint16_t>(~(1U << rock));
    return {good ? 10.0 : -10.0, NONE, false};
  }
  void place();
  void layOut();
  void solve();
  [[nodiscard]] int distance(int cell, int rock) const;
  [[nodiscard]] double exitValue(int cell) const;
  [[nodiscard]] double tour(int cell, unsigned set, const Chances& good) const;
  [[nodiscard]] int firstAction(int cell, unsigned set, const Chances& good) const;

  int n_;
  int k_;
  std::size_t cells_;
  std::vector<int> rock_cells_;           // (k,)
  std::vector<int> rock_at_;              // (n^2,): -1 for none
  std::vector<std::array<int, 4>> next_;  // (n^2,)
  std::vector<double> accuracy_;          // (n^2, k)
  std::vector<double> powers_;            // gamma^d
  std::vector<std::uint16_t> known_;      // (2^k, n^2), in UNITs
  std::vector<std::uint8_t> nearest_;     // (2^k, n^2): first rock of the best tour, k: exit
};

}  // namespace fabric::planner::examples

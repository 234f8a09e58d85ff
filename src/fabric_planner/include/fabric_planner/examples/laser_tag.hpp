// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fabric_planner/generative.hpp"
#include "fabric_planner/particle_belief.hpp"
#include "fabric_planner/random.hpp"

namespace fabric::planner::examples {

/// How a beam's reading falls around the true distance d; both are rounded down to whole units
/// and never below 0.
enum class ReadingNoise {
  SHORT,     ///< d - |N(0, sigma)|: beams stop early, as in ports of the paper's program
  SYMMETRIC  ///< d + N(0, sigma), as the text of the paper puts it
};

struct LaserTagOptions {
  int rows = 7;
  int columns = 11;
  int obstacles = 8;
  std::uint64_t layout_seed = 1;  ///< places the obstacles; the free cells stay connected
  double sigma = 2.5;             ///< cells
  ReadingNoise noise = ReadingNoise::SHORT;
};

/// LaserTag (Ye, Somani, Hsu & Lee, JAIR 58, 2017, section 6.1): find and tag an opponent who runs
/// away, without knowing where oneself is.
///
/// 7 x 11 cells, 8 of them obstacles: 69 x 69 pairs of cells and 69 ends, 4,830 states. Discount
/// 0.95. Actions: north, east, south, west (-1 each; a blocked move stays) and tag (+10 on the
/// opponent's cell and the end, -10 elsewhere). The opponent keeps its cell with probability 0.2;
/// else it flees along x or y with 0.4 each: away from the robot, either way when level with it
/// (0.2 and 0.2), and what is blocked stays. At first every pair of cells is equally likely.
/// Eight beams (N, E, S, W, NE, SE, SW, NW) measure the distance to the next wall, obstacle or
/// opponent, 1 for the adjacent cell and sqrt(2) along diagonals, with noise of 2.5 cells; on the
/// opponent's cell the observation says just that.
///
/// With so many observations every scenario of Despot soon has a branch of its own, in which
/// nothing is hidden any more. A high price of policy nodes (regularisation 1) keeps it from
/// believing what it finds there.
class LaserTag {
 public:
  /// Free cells are numbered row by row; opponent == numCells() means tagged.
  struct State {
    std::uint8_t robot;
    std::uint8_t opponent;
  };
  static constexpr int NUM_ACTIONS = 5;
  static constexpr int TAG = 4;
  static constexpr int NUM_BEAMS = 8;
  static constexpr int NUM_READINGS = 16;  ///< 0 .. 15; 15 takes what lies beyond
  static constexpr Observation SAME_CELL = ~Observation{0};

  /// @throw ModelError when an option is out of range or the obstacles leave no connected floor.
  explicit LaserTag(LaserTagOptions options = {});

  [[nodiscard]] int numActions() const { return NUM_ACTIONS; }
  [[nodiscard]] double discount() const { return 0.95; }
  [[nodiscard]] std::vector<std::string> actionNames() const;
  [[nodiscard]] const LaserTagOptions& options() const { return options_; }
  [[nodiscard]] int numCells() const { return num_cells_; }
  /// Row and column of a free cell.
  [[nodiscard]] std::array<int, 2> place(int cell) const { return places_[index(cell)]; }
  /// The reading of one beam out of an observation.
  [[nodiscard]] static int reading(Observation observation, int beam) {
    return static_cast<int>((observation >> (8 * beam)) & 0xFF);
  }
  /// True distance along a beam, cells. The opponent may be anywhere but on the robot's cell.
  [[nodiscard]] double distance(State state, int beam) const {
    return distances_[beams_[pair(state)][index(beam)]];
  }

  [[nodiscard]] RewardRange rewardRange() const { return {-10.0, 10.0}; }
  [[nodiscard]] State initialState(Random& random) const {
    const int robot = random.below(num_cells_);
    return {static_cast<std::uint8_t>(robot), static_cast<std::uint8_t>(random.below(num_cells_))};
  }
  Step step(State& state, int action, double u) const;
  /// Readings at a state in which the cells differ; random is used up.
  [[nodiscard]] Observation observe(State state, Random random) const;
  [[nodiscard]] double observationProbability(const State& next, int action,
                                              Observation observation) const;
  /// Value of the state if both cells were seen at every step.
  [[nodiscard]] double upperBound(const State& state) const {
    return isTerminal(state) ? 0.0 : static_cast<double>(best(seen_[pair(state)]));
  }
  /// Adds, for each action, its value if both cells were seen from the next step on (QMDP).
  void addUpperBounds(const State& state, double* sums) const {
    if (isTerminal(state)) return;
    const auto& values = seen_[pair(state)];
    for (std::size_t a = 0; a < NUM_ACTIONS; ++a) sums[a] += values[a];
  }
  /// The chase: the best action for a robot that will see both cells but only seldom act on it.
  [[nodiscard]] int defaultAction(const State* states, int count) const {
    return lowerBound(states, count).action;
  }
  /// The value of the chase if at every later step the robot saw both cells and did what is best
  /// with probability 0.15, and else moved at random. That is no policy that can be run, but what
  /// cannot be seen costs about as much: a cautious guess, which makes the robot go where it can
  /// hardly lose instead of where it would win if it could see.
  [[nodiscard]] LowerBound lowerBound(const State* states, int count) const;
  [[nodiscard]] double lowerBoundAtHorizon(const State& state) const {
    return isTerminal(state) ? 0.0 : -1.0 / (1.0 - discount());
  }
  /// The exact belief, a LaserTagBelief.
  [[nodiscard]] std::unique_ptr<Belief<State>> makeBelief(std::uint64_t seed) const;
  [[nodiscard]] bool isTerminal(const State& state) const { return state.opponent == num_cells_; }
  /// The free cell beside a cell, or the cell itself when that is blocked.
  [[nodiscard]] int neighbour(int cell, int direction) const {
    return neighbours_[index(cell)][index(direction)];
  }
  /// (numCells(),): P(opponent's next cell | robot's cell, opponent's cell).
  [[nodiscard]] std::vector<double> flight(int robot, int opponent) const;
  /// Adds to next (C * C,), by robot and opponent, the weights (C * C,) after an action; what the
  /// action ends is left out.
  void predict(int action, const std::vector<double>& weights, std::vector<double>& next) const;
  /// Multiplies weights (C * C,) by P(observation | a, s'); returns their sum.
  double weigh(Observation observation, std::vector<double>& weights) const;

 private:
  struct Flight {
    std::array<std::uint8_t, 5> cells;  ///< x away, x other, y away, y other, stay
    std::array<float, 4> until;         ///< cumulated probabilities
  };
  using ActionValues = std::vector<std::array<float, 8>>;  ///< (5,) used, a pair of cells each
  using Beams = std::array<std::uint8_t, NUM_BEAMS>;       ///< index into distances_

  static float best(const std::array<float, 8>& values) {
    return *std::max_element(values.begin(), values.begin() + NUM_ACTIONS);
  }
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] std::size_t pair(State s) const {
    return static_cast<std::size_t>(s.robot) * index(num_cells_) + s.opponent;
  }
  [[nodiscard]] int cellAt(int row, int column) const;
  void placeCells();
  bool numberCells();
  [[nodiscard]] bool connected() const;
  void makeFlights();
  void makeBeams();
  void makeReadings();
  [[nodiscard]] ActionValues solve(double wandering) const;
  [[nodiscard]] std::array<double, 8> backUp(int robot, int opponent,
                                             const std::vector<double>& values) const;
  [[nodiscard]] Flight flightOf(int robot, int opponent) const;
  [[nodiscard]] Beams beamsOf(int robot, int opponent) const;

  LaserTagOptions options_;
  int num_cells_ = 0;
  std::vector<std::array<int, 2>> places_;
  std::vector<int> cell_at_;  ///< row by row; -1 for an obstacle
  std::vector<std::array<std::uint8_t, 4>> neighbours_;
  std::vector<Flight> flights_;  ///< a pair of cells each
  std::vector<Beams> beams_;     ///< a pair of cells each
  std::vector<double> distances_;
  std::vector<std::array<std::int32_t, NUM_READINGS>> thresholds_;  ///< a distance each
  std::vector<std::array<float, NUM_READINGS>> probabilities_;      ///< a distance each
  ActionValues seen_;   ///< both cells seen from the next step on
  ActionValues chase_;  ///< the same, seldom acted on
};

/// The exact belief over both cells; it costs less than a cloud of 1,000 particles. An observation
/// without any chance falls back on all pairs of cells weighted by its likelihood, and when even
/// these have none, on the prediction; both are counted.
class LaserTagBelief final : public Belief<LaserTag::State> {
 public:
  /// @param model outlives the belief.
  explicit LaserTagBelief(const LaserTag& model);
  void reset(std::uint64_t seed) override;
  UpdateStatus update(int action, Observation observation) override;
  using Belief<LaserTag::State>::sample;
  void sample(Random& random, int count, LaserTag::State* out) const override;
  [[nodiscard]] std::uint64_t recoveries() const override { return recoveries_; }
  /// (C * C,), by robot and opponent, sums to 1.
  [[nodiscard]] const std::vector<double>& weights() const { return weights_; }

 private:
  const LaserTag& model_;
  std::vector<double> weights_;
  std::vector<double> next_;
  std::uint64_t recoveries_ = 0;
};

}  // namespace fabric::planner::examples

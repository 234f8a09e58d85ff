// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/examples/rock_sample.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace fabric::planner::examples {
namespace {

constexpr double HALF_EFFICIENCY = 20.0;  // cells
constexpr double SURE = 0.95;             // above it a check on the spot costs more than it saves

struct Place {
  int x;
  int y;
};

constexpr Place ROCKS_7_8[] = {{2, 0}, {0, 1}, {3, 1}, {6, 3}, {2, 4}, {3, 4}, {5, 5}, {1, 6}};
constexpr Place ROCKS_11_11[] = {{0, 3}, {0, 7}, {1, 8}, {2, 4}, {3, 3}, {3, 8},
                                 {4, 3}, {5, 8}, {6, 1}, {9, 3}, {9, 9}};

void requireRange(const char* what, int value, int low, int high) {
  if (value >= low && value <= high) return;
  throw ModelError(std::string("RockSample: ") + what + " is " + std::to_string(value) +
                   ", expected " + std::to_string(low) + " to " + std::to_string(high));
}

}  // namespace

RockSample::RockSample(int n, int k) : n_(n), k_(k), cells_(static_cast<std::size_t>(n * n)) {
  requireRange("n", n, 2, 32);
  requireRange("k", k, 1, std::min(MAX_ROCKS, n * n));
  place();
  layOut();
  solve();
}

std::vector<std::string> RockSample::actionNames() const {
  std::vector<std::string> names = {"north", "east", "south", "west", "sample"};
  for (int i = 0; i < k_; ++i) names.push_back("check_" + std::to_string(i));
  return names;
}

void RockSample::place() {
  const auto put = [&](Place place) { rock_cells_.push_back(place.x + n_ * place.y); };
  if (n_ == 7 && k_ == 8) {
    std::for_each(std::begin(ROCKS_7_8), std::end(ROCKS_7_8), put);
  } else if (n_ == 11 && k_ == 11) {
    std::for_each(std::begin(ROCKS_11_11), std::end(ROCKS_11_11), put);
  } else {
    Random random(static_cast<std::uint64_t>(100 * n_ + k_));
    while (static_cast<int>(rock_cells_.size()) < k_) {
      const int cell = random.below(n_ * n_);
      const auto same = std::find(rock_cells_.begin(), rock_cells_.end(), cell);
      if (same == rock_cells_.end()) rock_cells_.push_back(cell);
    }
  }
  rock_at_.assign(cells_, -1);
  for (int i = 0; i < k_; ++i) rock_at_[static_cast<std::size_t>(rockCell(i))] = i;
}

void RockSample::layOut() {
  for (int cell = 0; cell < n_ * n_; ++cell) {
    const int x = cell % n_;
    const int y = cell / n_;
    next_.push_back({y + 1 < n_ ? cell + n_ : WALL, x + 1 < n_ ? cell + 1 : EXIT,
                     y > 0 ? cell - n_ : WALL, x > 0 ? cell - 1 : WALL});
    for (int i = 0; i < k_; ++i) {
      const double d = std::hypot(rockCell(i) % n_ - x, rockCell(i) / n_ - y);
      accuracy_.push_back(0.5 * (1.0 + std::exp2(-d / HALF_EFFICIENCY)));
    }
  }
  powers_.assign(static_cast<std::size_t>(2 * n_ + 1), 1.0);
  for (std::size_t d = 1; d < powers_.size(); ++d) powers_[d] = powers_[d - 1] * discount();
}

int RockSample::distance(int cell, int rock) const {
  const int to = rockCell(rock);
  return std::abs(cell % n_ - to % n_) + std::abs(cell / n_ - to / n_);
}

double RockSample::exitValue(int cell) const {
  return 10.0 * powers_[static_cast<std::size_t>(n_ - 1 - cell % n_)];
}

/// V(cell, set) = max of leaving and, for a rock i of the set at distance d,
/// gamma^d (10 + gamma V(cell_i, set without i)). Smaller sets come first.
void RockSample::solve() {
  const std::size_t sets = std::size_t{1} << k_;
  known_.resize(sets * cells_);
  nearest_.resize(sets * cells_);
  std::vector<float> reach(static_cast<std::size_t>(k_) * cells_);  // gamma^d
  for (int i = 0; i < k_; ++i) {
    for (std::size_t cell = 0; cell < cells_; ++cell) {
      reach[i * cells_ + cell] = static_cast<float>(
          powers_[static_cast<std::size_t>(distance(static_cast<int>(cell), i))]);
    }
  }
  std::vector<float> best(cells_);
  std::vector<std::uint8_t> first(cells_);
  for (std::size_t set = 0; set < sets; ++set) {
    for (std::size_t c = 0; c < cells_; ++c) {
      best[c] = static_cast<float>(exitValue(static_cast<int>(c)));
    }
    std::fill(first.begin(), first.end(), static_cast<std::uint8_t>(k_));
    for (int i = 0; i < k_; ++i) {
      if (((set >> i) & 1) == 0) continue;
      const int rest = static_cast<int>(set & ~(std::size_t{1} << i));
      const auto there = static_cast<float>(10.0 + discount() * known(rockCell(i), rest));
      const float* way = reach.data() + i * cells_;
      for (std::size_t c = 0; c < cells_; ++c) {
        const float value = way[c] * there;
        first[c] = value > best[c] ? static_cast<std::uint8_t>(i) : first[c];
        best[c] = value > best[c] ? value : best[c];
      }
    }
    for (std::size_t c = 0; c < cells_; ++c) {
      known_[set * cells_ + c] = static_cast<std::uint16_t>(std::ceil(best[c] / UNIT));
      nearest_[set * cells_ + c] = first[c];
    }
  }
}

void RockSample::addUpperBounds(const State& state, double* sums) const {
  const double gamma = discount();
  const std::uint16_t* row = known_.data() + state.rocks * cells_;
  const double stay = gamma * UNIT * row[state.cell];
  for (int a = 0; a < SAMPLE; ++a) {
    const int to = next_[state.cell][static_cast<std::size_t>(a)];
    sums[a] += to >= 0 ? gamma * UNIT * row[to] : (to == EXIT ? 10.0 : stay - 100.0);
  }
  State sampled = state;
  const double reward = sample(sampled).reward;
  sums[SAMPLE] += reward + gamma * known(sampled.cell, sampled.rocks);
  for (int i = 0; i < k_; ++i) sums[CHECK + i] += stay;
}

/// The expected value of the tour: rocks are independent, so that the expected discount is a
/// product. A rock that is not nearly sure is checked on the spot, without error.
double RockSample::tour(int cell, unsigned set, const Chances& good) const {
  const double gamma = discount();
  double weight = 1.0;
  double value = 0.0;
  for (;;) {
    const int rock = nearest_[set * cells_ + static_cast<std::size_t>(cell)];
    if (rock == k_) return value + weight * exitValue(cell);
    const double p = good[static_cast<std::size_t>(rock)];
    weight *= powers_[static_cast<std::size_t>(distance(cell, rock))];
    if (p >= SURE) {
      value += weight * 10.0 * (2.0 * p - 1.0);
      weight *= gamma;
    } else {
      value += weight * gamma * p * 10.0;
      weight *= gamma * (1.0 - p + p * gamma);
    }
    cell = rockCell(rock);
    set &= ~(1U << rock);
  }
}

int RockSample::firstAction(int cell, unsigned set, const Chances& good) const {
  const int rock = nearest_[set * cells_ + static_cast<std::size_t>(cell)];
  if (rock == k_) return EAST;
  const int to = rockCell(rock);
  if (to == cell) return good[static_cast<std::size_t>(rock)] >= SURE ? SAMPLE : CHECK + rock;
  if (to % n_ != cell % n_) return to % n_ > cell % n_ ? EAST : WEST;
  return to > cell ? NORTH : SOUTH;
}

LowerBound RockSample::lowerBound(const State* states, int count) const {
  std::array<int, MAX_ROCKS> goods{};
  for (int i = 0; i < count; ++i) {
    for (int r = 0; r < MAX_ROCKS; ++r) goods[r] += (states[i].rocks >> r) & 1;
  }
  Chances chances{};
  for (int r = 0; r < k_; ++r) chances[r] = static_cast<double>(goods[r]) / count;
  const int cell = states[0].cell;
  LowerBound bound{tour(cell, 0, chances), EAST};
  unsigned tried = 0;
  for (const double least : {0.8, 0.5, 0.3, 0.1}) {
    unsigned set = 0;
    for (int r = 0; r < k_; ++r) set |= chances[r] > least ? 1U << r : 0U;
    if (set == tried) continue;
    tried = set;
    const double value = tour(cell, set, chances);
    if (value > bound.value) bound = {value, firstAction(cell, set, chances)};
  }
  return bound;
}

namespace {

/// The exact belief: the rover's cell is known, the rocks are independent.
class RockBelief final : public Belief<RockSample::State> {
 public:
  explicit RockBelief(const RockSample& model) : model_(model) { reset(0); }

  void reset(std::uint64_t /*seed*/) override {
    cell_ = static_cast<std::uint16_t>(model_.startCell());
    good_.assign(static_cast<std::size_t>(model_.rocks()), 0.5);
    recoveries_ = 0;
  }

  UpdateStatus update(int action, Observation observation) override {
    const bool possible = action < RockSample::CHECK
                              ? move(action, observation)
                              : hear(action - RockSample::CHECK, observation);
    recoveries_ += possible ? 0 : 1;
    return possible ? UpdateStatus::OK : UpdateStatus::RECOVERED;
  }

  using Belief<RockSample::State>::sample;
  void sample(Random& random, int count, RockSample::State* out) const override {
    for (int i = 0; i < count; ++i) out[i] = {cell_, 0};
    for (std::size_t r = 0; r < good_.size(); ++r) {
      const auto bit = static_cast<std::uint16_t>(1U << r);
      // Selection sampling (Knuth): the right number of good ones, in random places.
      int goods = static_cast<int>(good_[r] * count + random.uniform());
      for (int i = 0; i < count && goods > 0; ++i) {
        if (random.below(count - i) >= goods) continue;
        out[i].rocks |= bit;
        --goods;
      }
    }
  }

  [[nodiscard]] std::uint64_t recoveries() const override { return recoveries_; }

 private:
  bool move(int action, Observation observation) {
    RockSample::State state{cell_, 0};
    if (action == RockSample::SAMPLE) {
      for (std::size_t r = 0; r < good_.size(); ++r) {
        if (model_.rockCell(static_cast<int>(r)) == cell_) good_[r] = 0.0;
      }
    } else {
      model_.step(state, action, 0.0);
      cell_ = state.cell;
    }
    return observation == RockSample::NONE;
  }

  /// Bayes' rule for one rock; a contradiction is believed.
  bool hear(int rock, Observation observation) {
    if (observation == RockSample::NONE) return false;
    double& p = good_[static_cast<std::size_t>(rock)];
    const double right = model_.accuracy(cell_, rock);
    const double if_good = observation == RockSample::GOOD ? right : 1.0 - right;
    const double if_bad = 1.0 - if_good;
    const double total = if_good * p + if_bad * (1.0 - p);
    p = total > 0.0 ? if_good * p / total : if_good;
    return total > 0.0;
  }

  const RockSample& model_;
  std::uint16_t cell_ = 0;
  std::vector<double> good_;  // (k,): chance that the rock is good
  std::uint64_t recoveries_ = 0;
};

}  // namespace

std::unique_ptr<Belief<RockSample::State>> RockSample::makeBelief(std::uint64_t /*seed*/) const {
  return std::make_unique<RockBelief>(*this);
}

}  // namespace fabric::planner::examples

// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/examples/laser_tag.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <queue>
#include <random>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner::examples {
namespace {

constexpr std::array<std::array<int, 2>, 8> DIRECTIONS = {
    {{-1, 0}, {0, 1}, {1, 0}, {0, -1}, {-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};  // row, column
constexpr double MOVE_REWARD = -1.0;
constexpr double TAG_REWARD = 10.0;
constexpr double FALSE_TAG_REWARD = -10.0;
constexpr double WANDERING = 0.85;
constexpr double PRECISION = 1e-6;
constexpr double HALF = 2147483648.0;  // 2^31: thresholds are compared as signed integers

int sign(int x) { return (x > 0) - (x < 0); }

/// P(|N(0, sigma)| <= x).
double within(double x, double sigma) {
  return x <= 0.0 ? 0.0 : std::erf(x / (sigma * std::sqrt(2.0)));
}

/// P(N(0, sigma) <= x).
double below(double x, double sigma) { return 0.5 * std::erfc(-x / (sigma * std::sqrt(2.0))); }

/// P(reading <= k | distance).
double readingUpTo(int k, double distance, const LaserTagOptions& options) {
  if (k == LaserTag::NUM_READINGS - 1) return 1.0;
  const double noise = k + 1 - distance;  // the least noise that reads more than k
  if (options.noise == ReadingNoise::SYMMETRIC) return below(noise, options.sigma);
  return noise >= 0.0 ? 1.0 : 1.0 - within(-noise, options.sigma);
}

/// How many thresholds x has reached: the reading it stands for.
std::uint64_t countUpTo(const std::array<std::int32_t, LaserTag::NUM_READINGS>& thresholds,
                        std::int32_t x) {
  int count = 0;
  for (const std::int32_t threshold : thresholds) count += x >= threshold ? 1 : 0;
  return static_cast<std::uint64_t>(count);
}

void check(const LaserTagOptions& options) {
  const int cells = options.rows * options.columns;
  if (options.rows < 1 || options.columns < 1 || options.rows > 15 || options.columns > 15) {
    throw ModelError("laser tag: " + std::to_string(options.rows) + " x " +
                     std::to_string(options.columns) + " cells, expected 1 to 15 each way");
  }
  if (options.obstacles < 0 || options.obstacles > cells - 2) {
    throw ModelError("laser tag: " + std::to_string(options.obstacles) + " obstacles in " +
                     std::to_string(cells) + " cells");
  }
  if (!std::isfinite(options.sigma) || options.sigma <= 0.0) {
    throw ModelError("laser tag: sigma is " + std::to_string(options.sigma) +
                     ", expected a finite number > 0");
  }
}

}  // namespace

LaserTag::LaserTag(LaserTagOptions options) : options_(options) {
  check(options_);
  placeCells();
  makeFlights();
  makeBeams();
  makeReadings();
  seen_ = solve(0.0);
  chase_ = solve(WANDERING);
}

std::vector<std::string> LaserTag::actionNames() const {
  return {"north", "east", "south", "west", "tag"};
}

void LaserTag::placeCells() {
  const int cells = options_.rows * options_.columns;
  std::mt19937_64 random(options_.layout_seed);
  for (int trial = 0; trial < 1000; ++trial) {
    std::vector<int> order(index(cells));
    for (int i = 0; i < cells; ++i) order[index(i)] = i;
    for (int i = 0; i < options_.obstacles; ++i) {
      std::swap(order[index(i)],
                order[index(i) + random() % static_cast<std::uint64_t>(cells - i)]);
    }
    cell_at_.assign(index(cells), 0);
    for (int i = 0; i < options_.obstacles; ++i) cell_at_[index(order[index(i)])] = -1;
    if (numberCells()) return;
  }
  throw ModelError("laser tag: no connected floor with " + std::to_string(options_.obstacles) +
                   " obstacles found");
}

int LaserTag::cellAt(int row, int column) const {
  if (row < 0 || column < 0 || row >= options_.rows || column >= options_.columns) return -1;
  return cell_at_[index(row * options_.columns + column)];
}

bool LaserTag::numberCells() {
  places_.clear();
  for (int i = 0; i < options_.rows * options_.columns; ++i) {
    if (cell_at_[index(i)] < 0) continue;
    cell_at_[index(i)] = static_cast<int>(places_.size());
    places_.push_back({i / options_.columns, i % options_.columns});
  }
  num_cells_ = static_cast<int>(places_.size());
  neighbours_.assign(places_.size(), {});
  for (int cell = 0; cell < num_cells_; ++cell) {
    for (std::size_t d = 0; d < 4; ++d) {
      const int beside = cellAt(places_[index(cell)][0] + DIRECTIONS[d][0],
                                places_[index(cell)][1] + DIRECTIONS[d][1]);
      neighbours_[index(cell)][d] = static_cast<std::uint8_t>(beside < 0 ? cell : beside);
    }
  }
  return connected();
}

bool LaserTag::connected() const {
  std::vector<bool> seen(places_.size(), false);
  std::queue<int> open;
  open.push(0);
  seen[0] = true;
  int count = 1;
  while (!open.empty()) {
    for (const int next : neighbours_[index(open.front())]) {
      if (seen[index(next)]) continue;
      seen[index(next)] = true;
      ++count;
      open.push(next);
    }
    open.pop();
  }
  return count == num_cells_;
}

LaserTag::Flight LaserTag::flightOf(int robot, int opponent) const {
  Flight flight{};
  const auto [robot_row, robot_column] = places_[index(robot)];
  const auto [row, column] = places_[index(opponent)];
  const std::array<int, 2> away = {sign(row - robot_row), sign(column - robot_column)};
  double until = 0.0;
  std::size_t at = 0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    for (const int side : {1, -1}) {
      double p = away[axis] == 0 ? 0.2 : (away[axis] == side ? 0.4 : 0.0);
      const int next = axis == 0 ? cellAt(row + side, column) : cellAt(row, column + side);
      if (next < 0) p = 0.0;
      until += p;
      flight.cells[at] = static_cast<std::uint8_t>(next < 0 ? opponent : next);
      flight.until[at++] = static_cast<float>(until);
    }
  }
  flight.cells[4] = static_cast<std::uint8_t>(opponent);
  return flight;
}

void LaserTag::makeFlights() {
  for (int robot = 0; robot < num_cells_; ++robot) {
    for (int opponent = 0; opponent < num_cells_; ++opponent) {
      flights_.push_back(flightOf(robot, opponent));
    }
  }
}

std::vector<double> LaserTag::flight(int robot, int opponent) const {
  const Flight& moves = flights_[index(robot * num_cells_ + opponent)];
  std::vector<double> p(index(num_cells_), 0.0);
  double before = 0.0;
  for (std::size_t i = 0; i < moves.until.size(); ++i) {
    p[moves.cells[i]] += moves.until[i] - before;
    before = moves.until[i];
  }
  p[moves.cells[4]] += 1.0 - before;
  return p;
}

LaserTag::Beams LaserTag::beamsOf(int robot, int opponent) const {
  Beams beams{};
  const int longest = std::max(options_.rows, options_.columns);
  for (std::size_t d = 0; d < DIRECTIONS.size(); ++d) {
    int steps = 0;
    int cell = robot;
    auto [row, column] = places_[index(robot)];
    do {
      row += DIRECTIONS[d][0];
      column += DIRECTIONS[d][1];
      cell = cellAt(row, column);
      ++steps;
    } while (cell >= 0 && cell != opponent);
    beams[d] = static_cast<std::uint8_t>(steps - 1 + (d < 4 ? 0 : longest));
  }
  return beams;
}

void LaserTag::makeBeams() {
  const int longest = std::max(options_.rows, options_.columns);
  for (const double unit : {1.0, std::sqrt(2.0)}) {
    for (int steps = 1; steps <= longest; ++steps) distances_.push_back(unit * steps);
  }
  for (int robot = 0; robot < num_cells_; ++robot) {
    for (int opponent = 0; opponent < num_cells_; ++opponent) {
      beams_.push_back(beamsOf(robot, opponent));
    }
  }
}

void LaserTag::makeReadings() {
  for (const double distance : distances_) {
    std::array<std::int32_t, NUM_READINGS> thresholds{};
    std::array<float, NUM_READINGS> probabilities{};
    double before = 0.0;
    for (int k = 0; k < NUM_READINGS; ++k) {
      const double until = readingUpTo(k, distance, options_);
      probabilities[index(k)] = static_cast<float>(until - before);
      thresholds[index(k)] = static_cast<std::int32_t>(std::min(until * HALF, HALF - 1.0));
      if (until >= 1.0) thresholds[index(k)] = INT32_MAX;
      before = until;
    }
    thresholds_.push_back(thresholds);
    probabilities_.push_back(probabilities);
  }
}

/// Value iteration from above, so that every iterate bounds the value; a robot that wanders takes a
/// random move with that probability instead of the best action.
LaserTag::ActionValues LaserTag::solve(double wandering) const {
  std::vector<double> values(flights_.size(), TAG_REWARD);
  ActionValues actions(flights_.size());
  for (double change = 1.0; change > PRECISION;) {
    change = 0.0;
    for (int robot = 0; robot < num_cells_; ++robot) {
      for (int opponent = 0; opponent < num_cells_; ++opponent) {
        const auto at = index(robot * num_cells_ + opponent);
        const auto q = backUp(robot, opponent, values);
        const double best = *std::max_element(q.begin(), q.begin() + NUM_ACTIONS);
        const double moves = 0.25 * (q[0] + q[1] + q[2] + q[3]);
        const double value = (1.0 - wandering) * best + wandering * moves;
        change = std::max(change, values[at] - value);
        values[at] = value;
        std::copy(q.begin(), q.end(), actions[at].begin());
      }
    }
  }
  return actions;
}

std::array<double, 8> LaserTag::backUp(int robot, int opponent,
                                       const std::vector<double>& values) const {
  const Flight& flight = flights_[index(robot * num_cells_ + opponent)];
  std::array<double, 8> q{};
  for (int action = 0; action < NUM_ACTIONS; ++action) {
    double& value = q[index(action)];
    if (action == TAG && robot == opponent) {
      value = TAG_REWARD;
      continue;
    }
    value = action == TAG ? FALSE_TAG_REWARD : MOVE_REWARD;
    const int next = action == TAG ? robot : neighbour(robot, action);
    double before = 0.0;
    for (std::size_t i = 0; i < flight.cells.size(); ++i) {
      const double until = i < flight.until.size() ? flight.until[i] : 1.0;
      value += discount() * (until - before) * values[index(next * num_cells_ + flight.cells[i])];
      before = until;
    }
  }
  return q;
}

LowerBound LaserTag::lowerBound(const State* states, int count) const {
  std::array<float, 8> sums{};
  for (int i = 0; i < count; ++i) {
    if (isTerminal(states[i])) continue;
    const auto& values = chase_[pair(states[i])];
    for (std::size_t a = 0; a < sums.size(); ++a) sums[a] += values[a];
  }
  const auto most = std::max_element(sums.begin(), sums.begin() + NUM_ACTIONS);
  return {static_cast<double>(*most) / count, static_cast<int>(most - sums.begin())};
}

Step LaserTag::step(State& state, int action, double u) const {
  if (action == TAG && state.robot == state.opponent) {
    state.opponent = static_cast<std::uint8_t>(num_cells_);
    return {TAG_REWARD, SAME_CELL, true};
  }
  const Flight& flight = flights_[pair(state)];
  std::size_t outcome = 0;
  for (const float until : flight.until) outcome += u >= static_cast<double>(until) ? 1 : 0;
  state.opponent = flight.cells[outcome];
  if (action != TAG) state.robot = neighbours_[state.robot][index(action)];
  const double reward = action == TAG ? FALSE_TAG_REWARD : MOVE_REWARD;
  if (state.robot == state.opponent) return {reward, SAME_CELL, false};
  return {reward, observe(state, Random::of(u)), false};
}

Observation LaserTag::observe(State state, Random random) const {
  const Beams& beams = beams_[pair(state)];
  Observation observation = 0;
  for (std::size_t b = 0; b < NUM_BEAMS; b += 2) {
    const std::uint64_t bits = random.bits();
    const auto one = static_cast<std::int32_t>(bits >> 33);
    const auto other = static_cast<std::int32_t>((bits & 0xFFFFFFFF) >> 1);
    observation |= countUpTo(thresholds_[beams[b]], one) << (8 * b);
    observation |= countUpTo(thresholds_[beams[b + 1]], other) << (8 * b + 8);
  }
  return observation;
}

double LaserTag::observationProbability(const State& next, int /*action*/,
                                        Observation observation) const {
  if (isTerminal(next) || next.robot == next.opponent) return observation == SAME_CELL ? 1.0 : 0.0;
  if (observation == SAME_CELL) return 0.0;
  const Beams& beams = beams_[pair(next)];
  double p = 1.0;
  for (int b = 0; b < NUM_BEAMS; ++b) {
    const int k = reading(observation, b);
    p *= k < NUM_READINGS ? probabilities_[beams[index(b)]][index(k)] : 0.0F;
  }
  return p;
}

}  // namespace fabric::planner::examples

// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/examples/tag.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "../simd.hpp"

namespace fabric::planner::examples {
namespace {

using Cell = std::uint8_t;

struct Place {
  int x;
  int y;
};

constexpr int WIDTH = 10;
constexpr int ROWS = 2;            // of full width
constexpr int NICHE = 5;           // first column of the 3 x 3 cells above
constexpr double PATIENCE = 0.75;  // worth of a place one step further away
constexpr int FIRST = 1;           // the move of a robot that does not know where it is
constexpr Place MOVES[] = {{0, 1}, {1, 0}, {0, -1}, {-1, 0}};

Place placeOf(int cell) {
  if (cell < WIDTH * ROWS) return {cell % WIDTH, cell / WIDTH};
  const int rest = cell - WIDTH * ROWS;
  return {NICHE + rest % 3, ROWS + rest / 3};
}

/// -1: no such cell.
int cellAt(Place place) {
  if (place.y < 0 || place.y >= ROWS + 3 || place.x < 0 || place.x >= WIDTH) return -1;
  if (place.y < ROWS) return place.y * WIDTH + place.x;
  if (place.x < NICHE || place.x >= NICHE + 3) return -1;
  return WIDTH * ROWS + (place.y - ROWS) * 3 + place.x - NICHE;
}

Cell moved(int cell, Place by) {
  const Place from = placeOf(cell);
  const int to = cellAt({from.x + by.x, from.y + by.y});
  return static_cast<Cell>(to < 0 ? cell : to);
}

using Lane = std::array<float, 32>;

/// The cell other than the robot's that is likely and near, the lowest among equals. The cell's
/// number takes the place of the last bits of what it is worth, so that one maximum over lanes
/// finds it. Inlined, since clones do not share what they call.
[[gnu::always_inline]] inline int likelyAndNear(int robot, const Lane& cells, const Lane& reach) {
  Lane worth;
  std::array<std::uint32_t, 32> keys;
  for (std::size_t i = 0; i < 32; ++i) worth[i] = cells[i] * reach[i];
  std::memcpy(keys.data(), worth.data(), sizeof(keys));
  for (std::uint32_t cell = 0; cell < 32; ++cell) {
    keys[cell] = cell == static_cast<std::uint32_t>(robot) ? 0 : (keys[cell] & ~31U) | (31U - cell);
  }
  std::memcpy(worth.data(), keys.data(), sizeof(keys));
  for (std::size_t width = 16; width > 0; width /= 2) {
    for (std::size_t i = 0; i < width; ++i) worth[i] = std::max(worth[i], worth[i + width]);
  }
  std::uint32_t best = 0;
  std::memcpy(&best, worth.data(), sizeof(best));
  return static_cast<int>(31U - (best & 31U));
}

/// The exact belief over robot and opponent cells.
class TagBelief final : public Belief<Tag::State> {
 public:
  explicit TagBelief(const Tag& model) : model_(model) { reset(0); }

  void reset(std::uint64_t /*seed*/) override {
    belief_.assign(Tag::CELLS * Tag::CELLS, 1.0 / (Tag::CELLS * Tag::CELLS));
    recoveries_ = 0;
  }

  UpdateStatus update(int action, Observation observation) override {
    predict(action);
    double total = 0.0;
    for (std::size_t i = 0; i < next_.size(); ++i) {
      next_[i] *= Tag::observe(stateAt(i)) == observation ? 1.0 : 0.0;
      total += next_[i];
    }
    const bool possible = total > 0.0;
    if (!possible) total = spread(observation);
    for (double& p : next_) p /= total;
    belief_.swap(next_);
    recoveries_ += possible ? 0 : 1;
    return possible ? UpdateStatus::OK : UpdateStatus::RECOVERED;
  }

  using Belief<Tag::State>::sample;
  void sample(Random& random, int count, Tag::State* out) const override {
    Tag::State* next = out;
    systematicDraw(random, belief_.data(), static_cast<int>(belief_.size()), 1.0, count,
                   [&](int i) { *next++ = stateAt(static_cast<std::size_t>(i)); });
    shuffle(random, out, count);
  }

  [[nodiscard]] std::uint64_t recoveries() const override { return recoveries_; }

 private:
  static Tag::State stateAt(std::size_t index) {
    return {static_cast<Cell>(index / Tag::CELLS), static_cast<Cell>(index % Tag::CELLS)};
  }

  void predict(int action) {
    next_.assign(belief_.size(), 0.0);
    for (std::size_t i = 0; i < belief_.size(); ++i) {
      if (belief_[i] <= 0.0) continue;
      for (int k = 0; k < 5; ++k) {
        Tag::State state = stateAt(i);
        const Step step = model_.step(state, action, 0.2 * k + 0.1);
        if (!step.terminal) next_[Tag::index(state)] += 0.2 * belief_[i];
      }
    }
  }

  /// The states an impossible observation can come from, all alike. @return their number.
  double spread(Observation observation) {
    double total = 0.0;
    for (std::size_t i = 0; i < next_.size(); ++i) {
      next_[i] = Tag::observe(stateAt(i)) == observation ? 1.0 : 0.0;
      total += next_[i];
    }
    if (total > 0.0) return total;
    std::fill(next_.begin(), next_.end(), 1.0);
    return static_cast<double>(next_.size());
  }

  const Tag& model_;
  std::vector<double> belief_;  // by Tag::index()
  std::vector<double> next_;
  std::uint64_t recoveries_ = 0;
};

}  // namespace

Tag::Tag() : moves_(CELLS) {
  layOut();
  findDistances();
  solve();
}

std::vector<std::string> Tag::actionNames() const {
  return {"north", "east", "south", "west", "tag"};
}

void Tag::layOut() {
  for (int robot = 0; robot < CELLS; ++robot) {
    for (int a = 0; a < TAG; ++a) next_[robot][a] = moved(robot, MOVES[a]);
    next_[robot][TAG] = static_cast<Cell>(robot);
    for (int opponent = 0; opponent < CELLS; ++opponent) {
      const Place r = placeOf(robot);
      const Place o = placeOf(opponent);
      const int east = o.x >= r.x ? 1 : -1;
      const int west = o.x <= r.x ? -1 : 1;
      const int north = o.y >= r.y ? 1 : -1;
      const int south = o.y <= r.y ? -1 : 1;
      flight_[robot][opponent] = {moved(opponent, {east, 0}), moved(opponent, {west, 0}),
                                  moved(opponent, {0, north}), moved(opponent, {0, south}),
                                  static_cast<Cell>(opponent)};
      for (const Cell to : flight_[robot][opponent]) moves_[robot][opponent][to] += 0.2F;
    }
  }
}

void Tag::findDistances() {
  for (int goal = 0; goal < CELLS; ++goal) {
    std::array<int, CELLS> distance;
    distance.fill(CELLS);
    distance[goal] = 0;
    for (int round = 0; round < CELLS; ++round) {
      for (int cell = 0; cell < CELLS; ++cell) {
        for (int a = 0; a < TAG; ++a) {
          const int through = distance[next_[cell][a]] + 1;
          if (through >= distance[cell]) continue;
          distance[cell] = through;
          towards_[cell][goal] = static_cast<std::uint8_t>(a);
        }
      }
    }
    for (int cell = 0; cell < CELLS; ++cell)
      reach_[cell][goal] = static_cast<float>(std::pow(PATIENCE, distance[cell]));
  }
}

/// Fast informed bound (Hauskrecht 2000): max over the next action after the observation.
double Tag::backUp(const State& state, int action) const {
  std::array<std::array<double, ACTIONS>, 2> sums{};  // seen or not, next action
  for (int k = 0; k < FLIGHTS; ++k) {
    State next = state;
    const Step step = this->step(next, action, 0.2 * k + 0.1);
    if (step.terminal) return step.reward;
    auto& sum = sums[step.observation == SAME ? 1 : 0];
    for (int a = 0; a < ACTIONS; ++a) sum[a] += 0.2 * upper_[index(next)][a];
  }
  double value = 0.0;
  for (const auto& sum : sums) value += *std::max_element(sum.begin(), sum.end());
  return (action == TAG ? -10.0 : -1.0) + discount() * value;
}

void Tag::solve() {
  for (auto& bounds : upper_) bounds.fill(10.0F);
  for (double change = 1.0; change > 1e-4;) {
    change = 0.0;
    for (std::size_t i = 0; i < upper_.size(); ++i) {
      for (int a = 0; a < ACTIONS; ++a) {
        const State state{static_cast<Cell>(i / CELLS), static_cast<Cell>(i % CELLS)};
        const auto value = static_cast<float>(backUp(state, a));
        change = std::max(change, std::abs(static_cast<double>(value - upper_[i][a])));
        upper_[i][a] = value;
      }
    }
  }
}

double Tag::upperBound(const State& state) const {
  const auto& bounds = upper_[index(state)];
  return *std::max_element(bounds.begin(), bounds.end());
}

int Tag::defaultAction(const State* states, int count) const {
  const Cell robot = states[0].robot;
  Cells cells{};
  for (int i = 0; i < count; ++i) cells[states[i].opponent] += 1.0F;
  if (2.0F * cells[robot] > static_cast<float>(count)) return TAG;
  return towards_[robot][static_cast<std::size_t>(
      likelyAndNear(robot, cells, reach_[static_cast<std::size_t>(robot)]))];
}

LowerBound Tag::lowerBound(const State* states, int count) const {
  const Cell robot = states[0].robot;
  Cells cells{};
  bool same_robot = true;
  for (int i = 0; i < count; ++i) {
    cells[states[i].opponent] += 1.0F;
    same_robot = same_robot && states[i].robot == robot;
  }
  if (!same_robot) return {chaseUnknown(states, count) / count, FIRST};
  if (cells[robot] == static_cast<float>(count)) return {10.0, TAG};
  const int action = towards_[robot][static_cast<std::size_t>(
      likelyAndNear(robot, cells, reach_[static_cast<std::size_t>(robot)]))];
  return {chase(robot, cells, count) / count, action};
}

/// The policy's value times the mass, when the opponent is distributed like `cells`.
FABRIC_CLONES double Tag::chase(int robot, Cells cells, double mass) const {
  double value = 0.0;
  double weight = 1.0;
  const double enough = 2e-3 * mass;
  while (weight * mass > enough) {
    const auto& moves = moves_[static_cast<std::size_t>(robot)];
    robot = next_[robot][towards_[robot][static_cast<std::size_t>(
        likelyAndNear(robot, cells, reach_[static_cast<std::size_t>(robot)]))]];
    Cells next{};
    for (int cell = 0; cell < CELLS; ++cell) {
      if (cells[cell] <= 0.0F) continue;
      for (int to = 0; to < PADDED; ++to) next[to] += cells[cell] * moves[cell][to];
    }
    const double caught = next[robot];
    value += weight * (10.0 * discount() * caught - mass);
    next[robot] = 0.0F;
    cells = next;
    mass -= caught;
    weight *= discount();
  }
  return value - 20.0 * weight * mass;
}

/// The same when the robot knows its own cell only after the first step, as at the beginning.
double Tag::chaseUnknown(const State* states, int count) const {
  std::array<Cells, CELLS> found{};
  std::array<double, CELLS> masses{};
  double value = -count;
  for (int i = 0; i < count; ++i) {
    const int robot = next_[states[i].robot][FIRST];
    for (const Cell opponent : flight_[states[i].robot][states[i].opponent]) {
      if (robot == opponent) {
        value += 0.2 * 10.0 * discount();
      } else {
        found[robot][opponent] += 0.2F;
        masses[robot] += 0.2;
      }
    }
  }
  for (int robot = 0; robot < CELLS; ++robot) {
    if (masses[robot] > 0.0) value += discount() * chase(robot, found[robot], masses[robot]);
  }
  return value;
}

std::unique_ptr<Belief<Tag::State>> Tag::makeBelief(std::uint64_t /*seed*/) const {
  return std::make_unique<TagBelief>(*this);
}

}  // namespace fabric::planner::examples

// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "fabric_planner/examples/laser_tag.hpp"

namespace fabric::planner::examples {
namespace {

constexpr double NOTHING = 1e-12;  // what is less likely is not worth carrying on

}  // namespace

std::unique_ptr<Belief<LaserTag::State>> LaserTag::makeBelief(std::uint64_t /*seed*/) const {
  return std::make_unique<LaserTagBelief>(*this);
}

void LaserTag::predict(int action, const std::vector<double>& weights,
                       std::vector<double>& next) const {
  for (int robot = 0; robot < num_cells_; ++robot) {
    const int moved = action == TAG ? robot : neighbour(robot, action);
    for (int opponent = 0; opponent < num_cells_; ++opponent) {
      const auto at = index(robot * num_cells_ + opponent);
      if (weights[at] < NOTHING || (action == TAG && robot == opponent)) continue;
      const Flight& flight = flights_[at];
      double before = 0.0;
      for (std::size_t i = 0; i < flight.cells.size(); ++i) {
        const double until = i < flight.until.size() ? flight.until[i] : 1.0;
        next[index(moved * num_cells_ + flight.cells[i])] += weights[at] * (until - before);
        before = until;
      }
    }
  }
}

double LaserTag::weigh(Observation observation, std::vector<double>& weights) const {
  double total = 0.0;
  for (int robot = 0; robot < num_cells_; ++robot) {
    for (int opponent = 0; opponent < num_cells_; ++opponent) {
      double& weight = weights[index(robot * num_cells_ + opponent)];
      if (weight <= 0.0) continue;
      const State state{static_cast<std::uint8_t>(robot), static_cast<std::uint8_t>(opponent)};
      weight *= observationProbability(state, 0, observation);
      total += weight;
    }
  }
  return total;
}

LaserTagBelief::LaserTagBelief(const LaserTag& model) : model_(model) { reset(0); }

void LaserTagBelief::reset(std::uint64_t /*seed*/) {
  const auto pairs = static_cast<std::size_t>(model_.numCells() * model_.numCells());
  weights_.assign(pairs, 1.0 / static_cast<double>(pairs));
  recoveries_ = 0;
}

UpdateStatus LaserTagBelief::update(int action, Observation observation) {
  next_.assign(weights_.size(), 0.0);
  model_.predict(action, weights_, next_);
  auto status = UpdateStatus::OK;
  double total = model_.weigh(observation, next_);
  if (!(total > 0.0)) {
    status = UpdateStatus::RECOVERED;
    ++recoveries_;
    next_.assign(weights_.size(), 1.0);
    total = model_.weigh(observation, next_);
  }
  if (!(total > 0.0)) {
    next_.assign(weights_.size(), 0.0);
    model_.predict(action, weights_, next_);
    for (const double weight : next_) total += weight;
  }
  if (!(total > 0.0)) return status;
  for (double& weight : next_) weight /= total;
  weights_.swap(next_);
  return status;
}

void LaserTagBelief::sample(Random& random, int count, LaserTag::State* out) const {
  const int cells = model_.numCells();
  LaserTag::State* next = out;
  systematicDraw(random, weights_.data(), cells * cells, 1.0, count, [&](int i) {
    *next++ = {static_cast<std::uint8_t>(i / cells), static_cast<std::uint8_t>(i % cells)};
  });
  shuffle(random, out, count);
}

}  // namespace fabric::planner::examples

// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/tabular_model.hpp"

#include <algorithm>
#include <utility>

namespace fabric::planner {
namespace {

/// BeliefFilter, as the planners for generative models want it.
class TabularBelief final : public Belief<TabularModel::State> {
 public:
  explicit TabularBelief(std::shared_ptr<const Pomdp> model) : filter_(std::move(model)) {}

  void reset(std::uint64_t /*seed*/) override { filter_.reset(); }
  UpdateStatus update(int action, Observation observation) override {
    return filter_.update(action, static_cast<int>(observation));
  }
  using Belief<TabularModel::State>::sample;
  void sample(Random& random, int count, TabularModel::State* out) const override {
    TabularModel::State* next = out;
    const auto& belief = filter_.belief();
    systematicDraw(random, belief.data(), static_cast<int>(belief.size()), belief.sum(), count,
                   [&](int state) { *next++ = state; });
    shuffle(random, out, count);
  }
  [[nodiscard]] std::uint64_t recoveries() const override { return filter_.recoveries(); }

 private:
  BeliefFilter filter_;
};

void checkBounds(const Pomdp& model, const AlphaVectors& upper, const AlphaVectors& lower) {
  const Eigen::Index states = model.numStates();
  if (upper.vectors.rows() != model.numActions() || upper.vectors.cols() != states) {
    throw ModelError(
        model.name() + ": the upper bound has " + std::to_string(upper.vectors.rows()) +
        " vectors of " + std::to_string(upper.vectors.cols()) + ", expected one of " +
        std::to_string(states) + " for each of " + std::to_string(model.numActions()) + " actions");
  }
  if (lower.vectors.rows() < 1 || lower.vectors.cols() != states) {
    throw ModelError(model.name() + ": the lower bound has " +
                     std::to_string(lower.vectors.rows()) + " vectors of " +
                     std::to_string(lower.vectors.cols()) + ", expected at least one of " +
                     std::to_string(states));
  }
}

SparseRows asRow(const Eigen::VectorXd& distribution) {
  SparseRows row(1, distribution.size());
  for (Eigen::Index s = 0; s < distribution.size(); ++s) {
    if (distribution(s) > 0.0) row.insert(0, s) = distribution(s);
  }
  row.makeCompressed();
  return row;
}

}  // namespace

TabularModel::AliasTable::AliasTable(const SparseRows& rows) {
  begin_.reserve(static_cast<std::size_t>(rows.rows()) + 1);
  entries_.reserve(static_cast<std::size_t>(rows.nonZeros()));
  for (int row = 0; row < rows.rows(); ++row) addRow(rows, row);
}

/// Vose's construction: entries with too little are filled up by one with too much.
void TabularModel::AliasTable::addRow(const SparseRows& rows, int row) {
  const auto first = static_cast<std::int32_t>(entries_.size());
  for (SparseRows::InnerIterator it(rows, row); it; ++it) {
    const auto index = static_cast<std::int32_t>(it.col());
    entries_.push_back({it.value(), index, index});
  }
  const auto last = static_cast<std::int32_t>(entries_.size());
  begin_.push_back(last);
  std::vector<std::int32_t> small;
  std::vector<std::int32_t> large;
  for (std::int32_t i = first; i < last; ++i) {
    entries_[i].share *= last - first;
    (entries_[i].share < 1.0 ? small : large).push_back(i);
  }
  while (!small.empty() && !large.empty()) {
    const std::int32_t poor = small.back();
    const std::int32_t rich = large.back();
    small.pop_back();
    entries_[poor].other = entries_[rich].own;
    entries_[rich].share -= 1.0 - entries_[poor].share;
    if (entries_[rich].share >= 1.0) continue;
    large.pop_back();
    small.push_back(rich);
  }
}

TabularModel::TabularModel(std::shared_ptr<const Pomdp> pomdp)
    : TabularModel(pomdp, fastInformedBound(*pomdp), blindBound(*pomdp)) {}

TabularModel::TabularModel(std::shared_ptr<const Pomdp> pomdp, const AlphaVectors& upper,
                           const AlphaVectors& lower)
    : pomdp_(std::move(pomdp)),
      actions_(static_cast<std::size_t>(pomdp_->numActions())),
      states_(pomdp_->numStates()),
      range_{pomdp_->R().minCoeff(), pomdp_->R().maxCoeff()},
      start_(asRow(pomdp_->initialBelief())),
      lower_(lower.vectors),
      lower_actions_(lower.actions) {
  checkBounds(*pomdp_, upper, lower);
  for (int a = 0; a < pomdp_->numActions(); ++a) {
    transitions_.emplace_back(pomdp_->T(a));
    observations_.emplace_back(SparseRows(pomdp_->O(a)));
    for (int s = 0; s < states_; ++s) rewards_.push_back(pomdp_->R()(a, s));
  }
  for (int s = 0; s < states_; ++s) {
    for (int a = 0; a < pomdp_->numActions(); ++a) upper_.push_back(upper.vectors(a, s));
  }
}

double TabularModel::observationProbability(State next, int action, Observation o) const {
  return pomdp_->O(action).coeff(next, static_cast<Eigen::Index>(o));
}

double TabularModel::upperBound(State state) const {
  const auto row = upper_.begin() + static_cast<std::ptrdiff_t>(state * actions_);
  return *std::max_element(row, row + static_cast<std::ptrdiff_t>(actions_));
}

LowerBound TabularModel::lowerBound(const State* states, int count) const {
  Eigen::Index best = 0;
  if (count == 1) {
    const double value = lower_.col(states[0]).maxCoeff(&best);
    return {value, lower_actions_[static_cast<std::size_t>(best)]};
  }
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(lower_.rows());
  for (int i = 0; i < count; ++i) sums += lower_.col(states[i]);
  const double value = sums.maxCoeff(&best);
  return {value / count, lower_actions_[static_cast<std::size_t>(best)]};
}

std::unique_ptr<Belief<TabularModel::State>> TabularModel::makeBelief(
    std::uint64_t /*seed*/) const {
  return std::make_unique<TabularBelief>(pomdp_);
}

}  // namespace fabric::planner

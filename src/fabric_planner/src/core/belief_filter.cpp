// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/belief_filter.hpp"

#include <limits>

namespace fabric::planner {
namespace {

/// Below this a sum of probabilities has lost its digits and counts as zero.
constexpr double IMPOSSIBLE = std::numeric_limits<double>::min() / 1e-16;

}  // namespace

BeliefFilter::BeliefFilter(std::shared_ptr<const Pomdp> model)
    : model_(std::move(model)), belief_(model_->initialBelief()), predicted_(belief_.size()) {}

void BeliefFilter::reset() {
  belief_ = model_->initialBelief();
  recoveries_ = 0;
}

void BeliefFilter::reset(const Eigen::VectorXd& belief) {
  belief_ = model_->checkedBelief(belief);
  recoveries_ = 0;
}

UpdateStatus BeliefFilter::update(int action, int observation) {
  model_->checkAction(action);
  model_->checkObservation(observation);
  const Eigen::VectorXd likelihood = model_->O(action).col(observation);
  predicted_.noalias() = model_->T(action).transpose() * belief_;
  belief_ = predicted_.cwiseProduct(likelihood);
  const double probability = belief_.sum();
  if (probability > IMPOSSIBLE) {
    belief_ /= probability;
    return UpdateStatus::OK;
  }
  ++recoveries_;
  const double possible = likelihood.sum();
  if (possible > IMPOSSIBLE) {
    belief_ = likelihood / possible;
  } else {
    belief_ = predicted_ / predicted_.sum();
  }
  return UpdateStatus::RECOVERED;
}

}  // namespace fabric::planner

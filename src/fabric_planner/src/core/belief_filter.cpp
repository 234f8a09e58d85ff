// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/belief_filter.hpp"

#include <limits>

#include "kernels.hpp"
#include "padded_model.hpp"

namespace fabric::planner {
namespace {

/// Below this a sum of probabilities has lost its digits and counts as zero.
constexpr double IMPOSSIBLE = std::numeric_limits<double>::min() / 1e-16;

}  // namespace

BeliefFilter::BeliefFilter(std::shared_ptr<const Pomdp> model)
    : model_(std::move(model)),
      belief_(model_->initialBelief()),
      predicted_(Eigen::VectorXd::Zero(padded(model_->numStates()))),
      joint_(predicted_) {
  if (PaddedModel::fits(*model_)) padded_ = std::make_shared<const PaddedModel>(*model_);
}

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
  const double probability =
      padded_ ? jointPadded(action, observation) : jointSparse(action, observation);
  if (probability > IMPOSSIBLE) {
    const double scale = 1.0 / probability;
    const Eigen::Index states = belief_.size();
    for (Eigen::Index s = 0; s < states; ++s) belief_.data()[s] = joint_.data()[s] * scale;
    return UpdateStatus::OK;
  }
  recover(action, observation);
  return UpdateStatus::RECOVERED;
}

/// joint = P(s', o | b, a). @return its sum.
double BeliefFilter::jointPadded(int action, int observation) {
  const PaddedModel& m = *padded_;
  kernels::rowTimesTable(belief_.data(), m.T(action), static_cast<int>(belief_.size()),
                         m.stateWidth(), predicted_.data());
  return kernels::multiply(predicted_.data(), m.likelihood(action, observation), m.stateWidth(),
                           joint_.data());
}

double BeliefFilter::jointSparse(int action, int observation) {
  predictSparse(*model_, belief_.data(), action, predicted_.data());
  joint_.setZero();
  double sum = 0.0;
  for (SparseColumns::InnerIterator it(model_->O(action), observation); it; ++it) {
    joint_(it.row()) = predicted_(it.row()) * it.value();
    sum += joint_(it.row());
  }
  return sum;
}

void BeliefFilter::recover(int action, int observation) {
  ++recoveries_;
  const Eigen::VectorXd likelihood = model_->O(action).col(observation);
  const double possible = likelihood.sum();
  if (possible > IMPOSSIBLE) {
    belief_ = likelihood / possible;
  } else {
    const auto predicted = predicted_.head(belief_.size());
    belief_ = predicted / predicted.sum();
  }
}

}  // namespace fabric::planner

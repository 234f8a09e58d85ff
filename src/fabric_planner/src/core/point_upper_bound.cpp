// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>

#include "fabric_planner/bounds.hpp"

namespace fabric::planner {
namespace {

// HUGE_INVERSE times the smallest entry is above 1, so that a point's empty states never bind.
constexpr double HUGE_INVERSE = 1e305;
constexpr double SMALLEST_ENTRY = 1e-300;

/// max_a R(a, b) + gamma sum_o U(P(., o | b, a)).
double backedUp(const Pomdp& m, const PointUpperBound& bound, const Eigen::VectorXd& belief) {
  double best = -std::numeric_limits<double>::infinity();
  Eigen::VectorXd joint(belief.size());
  for (int a = 0; a < m.numActions(); ++a) {
    const Eigen::VectorXd predicted = m.T(a).transpose() * belief;
    double future = 0.0;
    for (int o = 0; o < m.numObservations(); ++o) {
      joint = predicted.cwiseProduct(Eigen::VectorXd(m.O(a).col(o)));
      if (joint.sum() > 0.0) future += bound.value(joint);
    }
    best = std::max(best, m.R().row(a).dot(belief) + m.discount() * future);
  }
  return best;
}

/// Multiplications of one round over all points and corners.
double roundWork(const Pomdp& m, Eigen::Index points) {
  const double s = m.numStates();
  const double one_belief =
      m.numActions() *
      (s * s + m.numObservations() * s * static_cast<double>(points + m.numActions()));
  return one_belief * (s + static_cast<double>(points));
}

/// One round of backups. @return the most that a value fell.
double backUpRound(const Pomdp& m, const Eigen::MatrixXd& beliefs, PointUpperBound& bound) {
  double gained = 0.0;
  // Late points are deep ones: what they gain reaches the early ones in the same round.
  for (Eigen::Index i = beliefs.cols(); i-- > 0;) {
    const double before = bound.value(beliefs.col(i));
    const double after = std::min(before, backedUp(m, bound, beliefs.col(i)));
    bound.lowerPoint(i, after);
    gained = std::max(gained, before - after);
  }
  Eigen::VectorXd corners(m.numStates());
  for (Eigen::Index s = 0; s < corners.size(); ++s) {
    const Eigen::VectorXd certain = Eigen::VectorXd::Unit(corners.size(), s);
    const double before = bound.value(certain);
    corners(s) = std::min(before, backedUp(m, bound, certain));
    gained = std::max(gained, before - corners(s));
  }
  bound.lowerCorners(corners);
  return gained;
}

}  // namespace

PointUpperBound::PointUpperBound(AlphaVectors base)
    : base_(std::move(base)), corners_(base_.vectors.colwise().maxCoeff().transpose()) {}

PointUpperBound::PointUpperBound(AlphaVectors base, const Eigen::MatrixXd& beliefs)
    : PointUpperBound(std::move(base)) {
  points_ = beliefs;
  base_at_points_ = base_.vectors * points_;
  values_ = base_at_points_.colwise().maxCoeff().transpose().array();
  inverse_ = (points_.array() > 0.0)
                 .select(points_.array().inverse().min(HUGE_INVERSE), HUGE_INVERSE)
                 .transpose();
  lowerCorners(corners_);
}

void PointUpperBound::lowerPoint(Eigen::Index point, double v) {
  values_(point) = std::min(values_(point), v);
  gain_(point) = values_(point) - corners_.dot(points_.col(point));
}

void PointUpperBound::lowerCorners(const Eigen::VectorXd& values) {
  corners_ = corners_.cwiseMin(values);
  gain_ = values_ - (corners_.transpose() * points_).transpose().array();
}

double PointUpperBound::value(const Eigen::Ref<const Eigen::VectorXd>& belief) const {
  const Eigen::VectorXd base = base_.vectors * belief;
  const double between_corners = corners_.dot(belief);
  const double plain = std::min(base.maxCoeff(), between_corners);
  if (values_.size() == 0) return plain;
  Eigen::ArrayXd phi = inverse_.col(0) * std::max(belief(0), SMALLEST_ENTRY);
  for (Eigen::Index s = 1; s < belief.size(); ++s) {
    phi = phi.min(inverse_.col(s) * std::max(belief(s), SMALLEST_ENTRY));
  }
  Eigen::Index point = 0;
  const double gain = (phi * gain_).minCoeff(&point);
  const double share = phi(point);
  const double rest = (base - share * base_at_points_.col(point)).maxCoeff();
  return std::min({plain, between_corners + gain, share * values_(point) + rest});
}

PointUpperBound pointBasedUpperBound(const Pomdp& model, const PointBasedOptions& options) {
  AlphaVectors base = fastInformedBound(model);
  if (model.fullyObservable()) return PointUpperBound(std::move(base));
  const Eigen::MatrixXd beliefs = reachableBeliefs(model, 64);
  PointUpperBound bound(std::move(base), beliefs);
  const double round_work = roundWork(model, beliefs.cols());
  for (double work = round_work; work < options.work; work += round_work) {
    if (backUpRound(model, beliefs, bound) < options.tolerance) break;
  }
  return bound;
}

}  // namespace fabric::planner

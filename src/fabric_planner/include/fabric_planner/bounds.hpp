// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// A bound on the optimal value that is the largest of linear functions of the belief.
struct AlphaVectors {
  Eigen::MatrixXd vectors;   ///< (K, S)
  std::vector<int> actions;  ///< (K,): the first action of each vector's policy

  /// Row with the largest value at the belief (S,), which need not be normalised.
  [[nodiscard]] int best(const Eigen::VectorXd& belief) const;
  [[nodiscard]] double value(const Eigen::VectorXd& belief) const;
};

/// Upper bound: the state becomes known after one step. One vector an action.
AlphaVectors qmdp(const Pomdp& model);

/// Upper bound, never above QMDP: the state becomes known one step late (Hauskrecht 2000),
/// Q(a, s) = R(a, s) + gamma sum_o max_a' sum_s' T(s, s') O(s', o) Q(a', s').
/// Iterated downwards from QMDP, so that it is a bound wherever it stops. One vector an action.
/// @throw ModelError when discount is 1.
AlphaVectors fastInformedBound(const Pomdp& model, double tolerance = 1e-6);

/// Lower bound: one action for ever. One vector an action. @throw ModelError when discount is 1.
AlphaVectors blindBound(const Pomdp& model);

/// How much work the point-based bounds may take; all counts, so that results repeat.
struct PointBasedOptions {
  int beliefs = 160;        ///< reachable beliefs at which the lower bound is improved
  int upper_points = 64;    ///< reachable beliefs at which the upper bound is improved
  int sweeps = 40;          ///< rounds of backups over all beliefs, lower bound
  int evaluations = 60;     ///< evaluation steps of the controller after each of them
  double work = 4e9;        ///< multiplications after which no further round begins
  double tolerance = 1e-7;  ///< a round that gains less anywhere is the last
};

/// Beliefs reachable from the initial one, each as far (L1) from the others as can be found by one
/// more step. @return (S, N), N <= count, the initial belief first.
Eigen::MatrixXd reachableBeliefs(const Pomdp& model, int count);

/// Lower bound, never below the blind one: point-based policy iteration (Ji et al. 2007).
/// Each vector is the value of a policy that can be executed. Deterministic. Exact for MDPs.
/// @throw ModelError when discount is 1.
AlphaVectors pointBasedBound(const Pomdp& model, const PointBasedOptions& options = {});

/// Upper bound that interpolates between beliefs whose value is known to be at most v.
///
/// The optimal value V is convex and homogeneous, so for the largest phi with phi p <= b it holds
/// that V(b) <= phi v + F(b - phi p) for any upper bound F. The point is picked by the sawtooth
/// rule, where F interpolates between certain states (corners); then the better of that F and the
/// base's alpha vectors is used.
class PointUpperBound {
 public:
  /// Without points it equals the base.
  explicit PointUpperBound(AlphaVectors base);
  /// beliefs: (S, N), at which the base is the first value.
  PointUpperBound(AlphaVectors base, const Eigen::MatrixXd& beliefs);

  /// belief: (S,), need not be normalised; the value scales with it.
  [[nodiscard]] double value(const Eigen::Ref<const Eigen::VectorXd>& belief) const;
  /// Lowers the bound at a point to v when that is less.
  void lowerPoint(Eigen::Index point, double v);
  /// Lowers the bound at the certain states to values (S,) where those are less.
  void lowerCorners(const Eigen::VectorXd& values);

  [[nodiscard]] const AlphaVectors& base() const { return base_; }
  [[nodiscard]] Eigen::Index numPoints() const { return values_.size(); }

 private:
  AlphaVectors base_;
  Eigen::VectorXd corners_;         ///< (S,)
  Eigen::MatrixXd points_;          ///< (S, N)
  Eigen::MatrixXd base_at_points_;  ///< (A, N)
  Eigen::ArrayXXd inverse_;         ///< (N, S): 1 / p(s), huge where p(s) is zero
  Eigen::ArrayXd values_;           ///< (N,)
  Eigen::ArrayXd gain_;             ///< (N,): values_ minus the interpolation between corners
};

/// Upper bound, never above the fast informed one: its values at the certain states and at
/// the beliefs of reachableBeliefs() are backed up in turn until they settle or the work is done.
/// Deterministic.
/// @throw ModelError when discount is 1.
PointUpperBound pointBasedUpperBound(const Pomdp& model, const PointBasedOptions& options = {});

}  // namespace fabric::planner

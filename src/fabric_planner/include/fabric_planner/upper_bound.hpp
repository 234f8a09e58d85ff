// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <memory>
#include <vector>

#include "fabric_planner/bounds.hpp"

namespace fabric::planner {

class PointTable;

/// Upper bound that interpolates between beliefs whose value is known to be at most v.
///
/// The optimal value V is convex and homogeneous, so that however a belief is made up of points,
/// b = sum_k w_k p_k + r with w, r >= 0, it holds that V(b) <= sum_k w_k v_k + F(r) for any upper
/// bound F. exactValue() finds the best such weights by linear programming; value() is
/// for searches: it takes one point, picked by the sawtooth rule, and the better F of certain
/// states (corners) and the base's vectors.
///
/// Immutable and cheap to copy. Both may be called from several threads; value() allocates nothing
/// after a thread's first call.
class PointUpperBound {
 public:
  /// Without points it equals the base.
  explicit PointUpperBound(AlphaVectors base);
  /// corners: (S,) at most this is a certain state worth; points: (S, N), columns sum to 1;
  /// values: (N,); value() looks at the first query_points of them.
  PointUpperBound(AlphaVectors base, const Eigen::VectorXd& corners, const Eigen::MatrixXd& points,
                  const Eigen::VectorXd& values, int query_points);

  /// belief: (S,), need not be normalised; the value scales with it. Some 0.2 us for 11 states and
  /// 128 points.
  [[nodiscard]] double value(const Eigen::Ref<const Eigen::VectorXd>& belief) const;
  /// The same by linear programming over all points: never above value(), some 20 us.
  [[nodiscard]] double exactValue(const Eigen::Ref<const Eigen::VectorXd>& belief) const;

  [[nodiscard]] const AlphaVectors& base() const { return base_; }
  /// How many points value() looks at.
  [[nodiscard]] Eigen::Index numPoints() const { return gain_.size(); }
  /// All points, (S, N), and what they are worth at most, (N,).
  [[nodiscard]] Eigen::MatrixXd points() const;
  [[nodiscard]] Eigen::VectorXd values() const;
  /// (S,).
  [[nodiscard]] const Eigen::VectorXd& corners() const { return corners_; }

 private:
  void prepareQueries(int query_points);

  AlphaVectors base_;
  Eigen::VectorXd corners_;
  std::shared_ptr<const PointTable> table_;  ///< null without points
  int stride_ = 0;
  std::vector<double> inverse_;     ///< (S, stride): 1 / p(s), huge where p(s) is zero
  std::vector<int> all_states_;     ///< 0 .. S - 1
  Eigen::ArrayXd gain_;             ///< (N,): value minus the interpolation between corners
  Eigen::MatrixXd base_at_points_;  ///< (A, N)
};

/// How much work the point-based upper bound may take; all counts, so that results repeat.
struct UpperBoundOptions {
  int points = 2000;       ///< at most
  int query_points = 128;  ///< of them, those nearest to the initial belief, for value()
  double work = 1e9;       ///< multiplications after which no further round begins
  double gap = 1e-6;       ///< to a lower bound at the initial belief that is small enough
};

/// Upper bound, never above the fast informed one: solve() with a limit on work. Deterministic.
/// @throw ModelError as fastInformedBound() and blindBound() do.
PointUpperBound pointBasedUpperBound(const Pomdp& model, const UpperBoundOptions& options = {});

}  // namespace fabric::planner

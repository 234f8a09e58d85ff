// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fabric_planner/bounds.hpp"

namespace fabric::planner {
class PointUpperBound {
 public:
  explicit PointUpperBound(AlphaVectors base);
  PointUpperBound(AlphaVectors base, const Eigen::MatrixXd& beliefs);
  [[nodiscard]] double value(const Eigen::Ref<const Eigen::VectorXd>& belief) const;
  void lowerPoint(Eigen::Index point, double v);
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
PointUpperBound pointBasedUpperBound(const Pomdp& model, const PointBasedOptions& options = {});
}

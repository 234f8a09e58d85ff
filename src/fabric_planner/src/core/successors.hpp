// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <memory>
#include <vector>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/pomdp.hpp"
#include "padded_model.hpp"
#include "simd.hpp"
#include "stopwatch.hpp"

namespace fabric::planner {

/// The beliefs one step further, with their probabilities and bounds.
///
/// Beliefs are (width(),): the states, then zeros. All successors of a small model are bounded at
/// once, in tables of full lanes; a larger model goes through its sparse tables. Nothing allocates
/// once this is made. Both bounds are homogeneous, so that they are taken at P(s', o | b, a) and
/// divided by its sum afterwards.
class Successors {
 public:
  /// lower, upper: must outlive this.
  Successors(const Pomdp& model, const AlphaVectors& lower, const PointUpperBound& upper);

  [[nodiscard]] int width() const { return width_; }

  /// Fills in, at a * O + o, P(o | b, a) and the bounds of the value at the belief after it; 0 and
  /// 0, 0 where that belief cannot be reached. @return false when time was up first.
  bool bound(const double* belief, Stopwatch& watch, double* probability, double* lower,
             double* upper);

  /// R(b, a).
  [[nodiscard]] double reward(const double* belief, int action) const;

  /// The belief after an action and an observation. @return false when it cannot be reached.
  bool follow(const double* belief, int action, int observation, double* next);

  /// The bounds at a belief itself.
  void boundsAt(const double* belief, double& lower, double& upper);

 private:
  bool boundPadded(const double* belief, Stopwatch& watch, double* probability, double* lower,
                   double* upper);
  void boundColumns(int first, int count, double* probability, double* lower, double* upper);
  bool boundSparse(const double* belief, Stopwatch& watch, double* probability, double* lower,
                   double* upper);
  bool refine(const double* belief, Stopwatch& watch, const double* probability,
              const double* lower, double* upper);
  [[nodiscard]] double mean(const double* probability, const double* value, int action) const;
  double upperAfter(int action, int observation);
  [[nodiscard]] double largestAtEntries(const std::vector<double>& functions, int count,
                                        int entries) const;
  /// (width,): P(s' | b, action).
  double* predicted(int action) {
    return predicted_.data() + static_cast<std::ptrdiff_t>(action) * width_;
  }
  /// Non-zero entries of P(., o | b, a) from predicted_. @return how many; their sum in `sum`.
  int gather(int action, int observation, double& sum);

  const Pomdp& m_;
  const Eigen::MatrixXd& vectors_;  ///< (K, S): the lower bound
  const PointUpperBound& upper_;
  std::unique_ptr<PaddedModel> padded_;  ///< of a small model, else none
  int width_;
  int columns_at_once_;
  double work_per_entry_;

  int lower_count_;            ///< vectors, filled up with copies
  int base_count_;             ///< the same of the upper bound
  std::vector<double> lower_;  ///< small: (lower_count_, S), else (S, lower_count_)
  std::vector<double> base_;

  AlignedArray<double> predicted_;  ///< (A, width)
  AlignedArray<double> points_;     ///< (S, columns_at_once_ padded)
  AlignedArray<double> sums_;
  AlignedArray<double> lowers_;
  AlignedArray<double> uppers_;
  std::vector<int> components_;  ///< states with a chance, or the entries' indices
  std::vector<double> values_;   ///< of those entries
  std::vector<double> joint_;    ///< (width,), zero between two uses when sparse
};

}  // namespace fabric::planner

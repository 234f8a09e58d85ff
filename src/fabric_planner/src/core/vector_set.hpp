// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "solver_model.hpp"

namespace fabric::planner {

/// Vectors over the states whose largest value at sparse beliefs is asked for often.
///
/// Kept twice: state by state (the values of all vectors at one state are neighbours), and vector
/// by vector, padded, for projections.
class VectorSet {
 public:
  explicit VectorSet(int states);

  [[nodiscard]] int size() const { return static_cast<int>(actions_.size()); }
  [[nodiscard]] int action(int k) const { return actions_[static_cast<size_t>(k)]; }
  /// (width,), padded with zeros.
  [[nodiscard]] const double* row(int k) const { return rows_.data() + k * width_; }

  /// vector: (S,).
  void add(const double* vector, int action);
  /// Replaces the values of a vector.
  void set(int k, const double* vector);
  /// Keeps the vectors named, in that order.
  void keep(const std::vector<int>& kept);

  struct Best {
    int vector;
    double value;
  };
  /// The largest value at a belief given by its n entries that are not zero; n may be 0.
  [[nodiscard]] Best best(const int* index, const double* value, int n) const;
  [[nodiscard]] Best best(const SparseBelief& belief) const {
    return best(belief.index.data(), belief.value.data(), belief.size());
  }
  /// (K, S).
  [[nodiscard]] Eigen::MatrixXd matrix() const;

 private:
  void reserve(int count);

  int states_, width_;
  int stride_ = 0;               ///< room for vectors
  std::vector<int> actions_;     ///< (K,)
  std::vector<double> columns_;  ///< (S, stride)
  std::vector<double> rows_;     ///< (K, width)
  mutable std::vector<double> scores_;
};

}  // namespace fabric::planner

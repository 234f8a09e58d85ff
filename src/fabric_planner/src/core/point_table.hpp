// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "solver_model.hpp"

namespace fabric::planner {

/// Beliefs at which the optimal value is known to be at most v, and the same for certain states
/// (corners). What lies between them is bounded by interpolation.
class PointTable {
 public:
  explicit PointTable(int states) : states_(states), corners_(static_cast<size_t>(states), 0.0) {}

  [[nodiscard]] int states() const { return states_; }
  [[nodiscard]] int size() const { return static_cast<int>(beliefs_.size()); }
  [[nodiscard]] double corner(int s) const { return corners_[static_cast<size_t>(s)]; }
  void setCorner(int s, double v) { corners_[static_cast<size_t>(s)] = v; }
  [[nodiscard]] double value(int k) const { return values_[static_cast<size_t>(k)]; }
  void setValue(int k, double v) { values_[static_cast<size_t>(k)] = v; }
  [[nodiscard]] const SparseBelief& belief(int k) const { return beliefs_[static_cast<size_t>(k)]; }
  void add(SparseBelief belief, double v);

  /// (S, stride): entry k of row s is what point k gives state s.
  [[nodiscard]] const double* rows() const { return rows_.data(); }
  [[nodiscard]] int stride() const { return stride_; }
  /// (stride,), beyond size() nothing that counts.
  [[nodiscard]] const double* values() const { return values_.data(); }
  /// (stride,): bit s % 64 is set where a point gives state s anything.
  [[nodiscard]] const std::uint64_t* masks() const { return masks_.data(); }

 private:
  void reserve(int count);

  int states_;
  int stride_ = 0;
  std::vector<double> corners_;
  std::vector<SparseBelief> beliefs_;
  std::vector<double> rows_;
  std::vector<double> values_;
  std::vector<std::uint64_t> masks_;
};

/// The bits of the states that are possible.
std::uint64_t maskOf(const int* index, int n);

}  // namespace fabric::planner

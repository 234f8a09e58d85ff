// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "point_table.hpp"

namespace fabric::planner {

/// Finds the cheapest way to make a vector up of points and corners, a linear program:
///   min sum_k w_k v_k + sum_s r_s c_s  so that  sum_k w_k p_k + r = tau,  w, r >= 0.
///
/// Primal revised simplex with an explicit inverse; the rows are the states that tau makes
/// possible. Since tau stays the same while values fall and points are added, the basis of last
/// time is still feasible and mostly still the best: it is then checked by one product of a row
/// with the table. The answer is recomputed from weights that are not negative and a rest that is
/// not negative either, hence an upper bound however the arithmetic went.
class Interpolator {
 public:
  /// With more rows than these a single point is taken, by the sawtooth rule.
  static constexpr int MAX_ROWS = 64;

  /// @param index, tau (n,) the vector by its entries above zero.
  /// @param[in,out] basis (n,): a point's number or -1 for the corner; all -1 to begin with.
  /// @return the value; weights() and rest() tell how it is made up.
  double solve(const PointTable& table, const int* index, const double* tau, int n, int* basis);

  struct Weight {
    int point;
    double weight;
  };
  [[nodiscard]] const std::vector<Weight>& weights() const { return weights_; }
  /// (n,): what corners get.
  [[nodiscard]] const std::vector<double>& rest() const { return rest_; }
  /// Multiplications so far.
  [[nodiscard]] double work() const { return work_; }

 private:
  void begin(const PointTable& table, const int* index, const double* tau, int n);
  void restore(int* basis);
  void clear(int* basis);
  bool improve(int* basis);
  void findPrices(const int* basis);
  [[nodiscard]] double reducedCost(int column) const;
  /// The column with the most negative reduced cost, -2 - r for the corner of row r; -1 for none.
  int entering(const int* basis);
  int enteringCorner(const int* basis, double& least) const;
  int enteringCandidate(double& least);
  int enteringPoint(double least);
  int smallestReduced();
  /// Copies the columns that promise most, so that not every step has to look at the whole table.
  void gatherCandidates(double least);
  [[nodiscard]] bool fits(int point) const;
  void express(int column);
  int leaving() const;
  void pivot(int row);
  void takeOnePoint(int* basis);
  double certify(const int* basis);

  const PointTable* table_ = nullptr;
  const int* index_ = nullptr;
  const double* tau_ = nullptr;
  int n_ = 0;
  double tolerance_ = 0.0;
  std::vector<double> inverse_;  ///< (n, MAX_ROWS)
  std::vector<double> amounts_;  ///< (n,) inverse times tau
  std::vector<double> prices_;   ///< (n,) minus the dual values
  std::vector<double> column_;   ///< (n,) inverse times the entering column
  std::vector<double> entries_;  ///< (n,) the entering column, padded with zeros
  std::vector<double> costs_;    ///< (stride,) values, huge where a point does not fit
  std::vector<double> reduced_;  ///< (stride,)
  std::vector<double> minima_;   ///< of each block of reduced_
  std::vector<int> candidates_;
  std::vector<double> columns_;  ///< (n, MAX_CANDIDATES) of the candidates
  std::vector<double> candidate_costs_;
  std::vector<int> rows_;  ///< 0 .. MAX_ROWS - 1
  std::vector<Weight> weights_;
  std::vector<double> rest_;
  double work_ = 0.0;
};

}  // namespace fabric::planner

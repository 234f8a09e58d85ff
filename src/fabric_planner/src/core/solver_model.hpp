// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// A vector over the states by its entries that are not zero, states ascending.
struct SparseBelief {
  std::vector<int> index;
  std::vector<double> value;

  SparseBelief() = default;
  explicit SparseBelief(const Eigen::Ref<const Eigen::VectorXd>& dense);
  [[nodiscard]] int size() const { return static_cast<int>(index.size()); }
  [[nodiscard]] double sum() const;
  [[nodiscard]] Eigen::VectorXd dense(int states) const;
};

/// L1 distance.
double distance(const SparseBelief& left, const SparseBelief& right);

/// What may be seen after an action at a belief: for each observation P(s', o | b, a).
class Outcomes {
 public:
  [[nodiscard]] int size(int o) const { return counts_[static_cast<size_t>(o)]; }
  [[nodiscard]] const int* index(int o) const { return index_.data() + begin(o); }
  [[nodiscard]] const double* value(int o) const { return value_.data() + begin(o); }
  /// P(o | b, a).
  [[nodiscard]] double probability(int o) const;
  /// The belief after o; P(o | b, a) must not be zero.
  [[nodiscard]] SparseBelief normalised(int o) const;
  /// P(s' | b, a).
  [[nodiscard]] const SparseBelief& predicted() const { return predicted_; }

 private:
  friend class SolverModel;
  [[nodiscard]] size_t begin(int o) const { return static_cast<size_t>(o) * capacity_; }

  SparseBelief predicted_;
  size_t capacity_ = 0;      ///< entries reserved for each observation
  std::vector<int> counts_;  ///< (O,)
  std::vector<int> index_;
  std::vector<double> value_;
  std::vector<double> dense_;  ///< (S,), zero between calls
  std::vector<int> touched_;
};

/// A model's tables as the solvers read them: compressed, and written out padded when it is small.
class SolverModel {
 public:
  /// model: must outlive this.
  explicit SolverModel(const Pomdp& model);

  [[nodiscard]] const Pomdp& pomdp() const { return m_; }
  [[nodiscard]] int states() const { return states_; }
  [[nodiscard]] int actions() const { return actions_; }
  [[nodiscard]] int observations() const { return observations_; }
  [[nodiscard]] double discount() const { return m_.discount(); }
  /// Length of a padded vector over the states.
  [[nodiscard]] int width() const { return width_; }

  [[nodiscard]] double reward(const SparseBelief& belief, int action) const;
  [[nodiscard]] bool isAllowed(const SparseBelief& belief, int action) const;
  void successors(const SparseBelief& belief, int action, Outcomes& out) const;

  /// out = gamma T_a sum_o O_a(., o) * next[o], each vector over the states.
  /// next: (O,) pointers to padded vectors; out: padded; scratch: padded.
  void backProject(int action, const double* const* next, double* scratch, double* out) const;
  /// Multiplications of one such projection, of the successors of a belief of so many states.
  [[nodiscard]] double projectionWork() const { return projection_work_; }
  [[nodiscard]] double successorWork(int possible_states) const;

 private:
  using Rows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  void writeOut();

  const Pomdp& m_;
  int states_, actions_, observations_, width_;
  double projection_work_ = 0.0;
  std::vector<Rows> O_;  ///< per action (S', O), a row a state
  bool written_out_ = false;
  std::vector<double> T_dense_;  ///< (A, S', width): column s' of T_a times gamma
  std::vector<double> O_dense_;  ///< (A, O, width)
};

}  // namespace fabric::planner

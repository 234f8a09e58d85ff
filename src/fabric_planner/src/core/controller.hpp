// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "solver_model.hpp"

namespace fabric::planner {

/// A finite-state controller: node i takes action(i), sees o and goes to node next(i, o), or stops
/// following nodes there and collects what a known vector says.
///
/// Its value solves x_i = R_a + gamma T_a sum_o O_a(., o) * x_next(i, o), N * S unknowns.
class Controller {
 public:
  /// model: must outlive this.
  explicit Controller(const SolverModel& model) : m_(model) {}

  /// next: (O,) indices below numNodes() for nodes, above for knownVectors in turn.
  void add(int action, const std::vector<int>& next);
  [[nodiscard]] int numNodes() const { return static_cast<int>(actions_.size()); }

  /// Values of the nodes, never above the true ones but for rounding.
  /// @param known vectors (padded) that next may lead to; lower bounds or values of policies.
  /// @param start (width, N), where to begin; values of policies too.
  /// @param[out] work multiplications are added.
  [[nodiscard]] Eigen::MatrixXd evaluate(const std::vector<const double*>& known,
                                         Eigen::MatrixXd start, double& work) const;

 private:
  using Table = Eigen::MatrixXd;

  /// y = rewards (if asked for) + gamma P x; known: the constants, null when they are left out.
  void step(const Table& x, const std::vector<const double*>* known, Table& y) const;
  [[nodiscard]] bool solveByKrylov(const std::vector<const double*>& known, Table& x,
                                   double& work) const;
  void sweep(const std::vector<const double*>& known, Table& x, double& work) const;
  [[nodiscard]] double stepWork() const;

  const SolverModel& m_;
  std::vector<int> actions_;
  std::vector<int> next_;  ///< (N, O)
};

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

struct MdpSolution {
  Eigen::VectorXd value;    ///< (S,): best expected discounted reward
  Eigen::MatrixXd q;        ///< (A, S): the same after a first action
  std::vector<int> policy;  ///< (S,): best action, the lowest index among equals
};

/// Solves the MDP under a POMDP, as if its state were seen.
///
/// Value iteration from an upper bound, then policy iteration with exact (linear) evaluation as
/// long as the state space is small enough for it; larger ones, and discount 1, are left to value
/// iteration, which stops within `tolerance` of the value and never below it.
/// @throw ModelError when discount is 1 and the value does not settle.
MdpSolution solveMdp(const Pomdp& model, double tolerance = 1e-9);

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

struct MdpSolution {
  Eigen::VectorXd value;    ///< (S,): best expected discounted reward
  Eigen::MatrixXd q;        ///< (A, S): the same after a first action; -inf where not allowed
  std::vector<int> policy;  ///< (S,): best action, the lowest index among equals
};

/// Solves the MDP under a POMDP, as if its state were seen, by Gauss-Seidel value iteration that
/// comes down from a value that nothing exceeds: `value` is at most `tolerance` above the exact one
/// and, up to rounding, never below it.
/// With discount 1 it stops when nothing moves any more.
/// @throw ModelError when tolerance is not positive or the value does not settle (discount 1 where
///   reward or cost can be collected for ever).
MdpSolution valueIteration(const Pomdp& model, double tolerance = 1e-9);

/// The same by policy iteration (Howard 1960), exact up to rounding: each policy is evaluated by
/// LU where there are few states, otherwise by sweeps until nothing moves any more.
/// With discount 1 it begins with the policy that value iteration finds.
/// @throw ModelError when the value does not settle.
MdpSolution policyIteration(const Pomdp& model);

/// Policy iteration where the discount is below 1 and there are few states, else value iteration.
/// @throw ModelError as they do.
MdpSolution solveMdp(const Pomdp& model, double tolerance = 1e-9);

}  // namespace fabric::planner

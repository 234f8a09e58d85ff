// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/decision.hpp"
#include "fabric_planner/online_planner.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// How the robot's decisions are found.
enum class SolverKind {
  SEARCH,   ///< OnlinePlanner: search over exact beliefs between certified bounds
  OFFLINE,  ///< the best vector computed beforehand; no search at all
  DESPOT,   ///< Despot on scenarios drawn from the exact belief
  POMCP,    ///< Pomcp, the baseline
};

/// search, offline, despot or pomcp. @throw ModelError naming these.
SolverKind solverFromName(const std::string& name);
std::string solverName(SolverKind kind);

/// One way to find decisions for one model, from step to step. Not for several threads at once.
class DecisionSolver {
 public:
  virtual ~DecisionSolver() = default;
  /// @param belief (S,), sums to 1. @throw ModelError when it is no distribution, or when no
  /// action may be taken there.
  virtual Decision decide(const Eigen::VectorXd& belief) = 0;
  /// What was done at the last belief and observed then.
  virtual void advance(int action, int observation) = 0;
  /// Forgets everything but the model: decisions repeat from here on, unless a deadline ends them.
  virtual void reset() = 0;
};

/// @param options deadline and gap; max_nodes are beliefs for SEARCH, histories for DESPOT and
///        simulations for POMCP.
/// @param policy vectors known beforehand: OFFLINE runs them, SEARCH counts on them as a lower
///        bound beside its own. OFFLINE without them takes those of pointBasedBound().
/// @param seed of the draws of DESPOT and POMCP.
/// @throw ModelError when the model, an option or the policy cannot be used.
std::unique_ptr<DecisionSolver> makeSolver(SolverKind kind,
                                           const std::shared_ptr<const Pomdp>& model,
                                           const PlannerOptions& options,
                                           const std::optional<AlphaVectors>& policy = std::nullopt,
                                           std::uint64_t seed = 1);

}  // namespace fabric::planner

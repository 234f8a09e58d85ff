// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <functional>
#include <vector>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/online_planner.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// Anything that acts on a belief.
struct BeliefPolicy {
  /// The action at the belief (S,). Required.
  std::function<int(const Eigen::VectorXd&)> decide;
  /// Told what was done and seen then; may be empty.
  std::function<void(int action, int observation)> advance;
  /// Told that an episode begins; may be empty.
  std::function<void()> reset;
};

/// Decides by online search, its tree kept from step to step. planner: must outlive the policy.
BeliefPolicy policyOf(OnlinePlanner& planner);
/// Takes the action of the best vector that is allowed at the belief. vectors: of S columns.
/// @throw ModelError at a belief where no vector's action is allowed.
BeliefPolicy policyOf(const Pomdp& model, AlphaVectors vectors);

/// One step of a simulated episode.
struct SimulatedStep {
  int state;  ///< before the action
  int action;
  int observation;
  double reward;           ///< R(s, a)
  Eigen::VectorXd belief;  ///< (S,), before the action
};

/// Runs one episode from the model's initial belief until a terminal state or `steps` steps.
/// States and observations are drawn from `seed`, with a stream of their own each step, so that
/// two policies meet the same luck as long as they act alike.
/// @throw std::out_of_range when the policy's action is none of the model's.
std::vector<SimulatedStep> simulate(const Pomdp& model, const BeliefPolicy& policy, int steps,
                                    std::uint64_t seed);

struct EvaluationOptions {
  int episodes = 200;      ///< >= 2
  int steps = 0;           ///< of an episode; 0: until what is left counts less than 1e-6
  std::uint64_t seed = 1;  ///< episode i of two evaluations with one seed has the same luck
};

/// What a policy is worth from the initial belief.
///
/// The return of one episode varies much. cv says the same with less noise: for any function V of
/// the belief, with Q its backup over the exact successors, the value of a policy is
///     V(b_0) - E[ sum_t gamma^t (V(b_t) - Q(b_t, a_t)) ],
/// since V(b_0) = E[ sum_t gamma^t (V(b_t) - gamma V(b_t+1)) ] (Kakade and Langford 2002, Lemma
/// 6.1). The nearer V is to the optimal value, the smaller are the terms. Episodes are cut after
/// `steps`; what comes later is left out of the return, and counted as V in cv.
struct Evaluation {
  double mean_return = 0.0;  ///< discounted
  double standard_error = 0.0;
  double cv = 0.0;
  double cv_standard_error = 0.0;
  std::int64_t decisions = 0;
  double decision_time = 0.0;         ///< s of the thread's own time a decision, mean
  double median_decision_time = 0.0;  ///< s
};

/// @param reference V, the largest of these vectors; a good lower bound. Without vectors only the
///        return is measured, and cv and its error are NaN.
/// @throw ModelError when options are out of range or the reference has not S columns.
Evaluation evaluate(const Pomdp& model, const BeliefPolicy& policy, const AlphaVectors& reference,
                    const EvaluationOptions& options = {});

}  // namespace fabric::planner

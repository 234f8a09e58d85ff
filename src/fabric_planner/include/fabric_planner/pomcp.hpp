// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "fabric_planner/decision.hpp"
#include "fabric_planner/generative.hpp"
#include "fabric_planner/history_tree.hpp"
#include "fabric_planner/particle_belief.hpp"
#include "fabric_planner/pomdp.hpp"
#include "fabric_planner/search_clock.hpp"

namespace fabric::planner {

enum class Rollout {
  RANDOM,         ///< legal actions, uniformly: the plain baseline
  DEFAULT_ACTION  ///< the model's defaultAction() for the one simulated state; RANDOM without one
};

struct PomcpOptions {
  double deadline = 0.01;         ///< s of steady time a decision may take, >= 0
  int max_simulations = 1 << 30;  ///< simulations a decision may run, >= 0
  double exploration = -1.0;      ///< c of UCB1, in rewards; < 0: high - low of the reward range
  int max_depth = 90;             ///< steps of one simulation, >= 1
  Rollout rollout = Rollout::RANDOM;
  std::size_t memory = std::size_t{32} << 20;  ///< bytes of the tree, all taken at the start
  std::uint64_t seed = 1;
  bool cpu_time = false;  ///< the deadline counts CPU time of the calling thread: for measurements
};

/// Partially observable Monte-Carlo planning (Silver & Veness, NIPS 2010): UCT over histories.
///
/// A simulation starts at a state drawn from the belief and goes down the tree of histories,
/// taking the action with the largest Q(h a) + c sqrt(log N(h) / N(h a)) (UCB1) and the
/// observation the model gives. It adds one history and plays on from there by the rollout policy;
/// Q(h a) is the mean of the discounted rewards that followed. This is the baseline beside Despot:
/// no preferred actions and no prior values.
///
/// Nothing here is a certificate: `value` is the mean return of the simulations through the action
/// and the bounds of the Decision are minus and plus infinity. `ended_by` says NODES when
/// max_simulations were run, else DEADLINE. A deadline too short for one simulation is answered by
/// the rollout policy (`fallback_used`).
///
/// advance() keeps the part of the tree below what happened; decide() without it starts a new
/// tree, so do changes of the belief the planner was not told of. When the memory is full,
/// simulations go on in the tree there is; a kept tree that fills more than three quarters of it
/// is given up. The same calls give the same decisions unless they end by DEADLINE. decide() and
/// advance() may be called from several threads; calls wait for one another.
template <class Model>
class Pomcp {
 public:
  using State = typename Model::State;

  /// @param model outlives the planner. @throw ModelError when an option is out of range.
  explicit Pomcp(const Model& model, PomcpOptions options = {})
      : model_(model),
        options_(options),
        tree_(model.numActions(), options.memory),
        random_(options.seed) {
    generative::check(model);
    checkOptions(options.deadline, options.max_simulations, options.exploration, options.max_depth);
    const RewardRange range = model.rewardRange();
    exploration_ = options.exploration < 0.0 ? range.high - range.low : options.exploration;
    default_rollout_ =
        options.rollout == Rollout::DEFAULT_ACTION && generative::hasDefaultAction(model);
    path_.resize(static_cast<std::size_t>(options.max_depth));
    states_.resize(BATCH);
  }

  Decision decide(const Belief<State>& belief) {
    const std::lock_guard<std::mutex> lock(one_at_a_time_);
    SearchClock clock(options_.deadline, options_.cpu_time);
    prepare(belief);
    int simulations = 0;
    while (simulations < options_.max_simulations && simulate(belief, clock)) ++simulations;
    kept_ = false;
    Decision decision = choose();
    decision.trials = simulations;
    decision.ended_by =
        simulations >= options_.max_simulations ? EndedBy::NODES : EndedBy::DEADLINE;
    decision.planning_time = clock.elapsed();
    decision.deadline_missed = decision.planning_time > options_.deadline;
    return decision;
  }

  /// Tells what was done and seen since the last decision; its tree is kept for the next one.
  void advance(int action, Observation observation) {
    const std::lock_guard<std::mutex> lock(one_at_a_time_);
    if (action < 0 || action >= model_.numActions()) {
      throw std::out_of_range("POMCP: action " + std::to_string(action) + " of " +
                              std::to_string(model_.numActions()));
    }
    kept_ = tree_.moveRoot(action, observation);
  }

  /// Forgets the tree and starts the random numbers again.
  void reset(std::uint64_t seed) {
    const std::lock_guard<std::mutex> lock(one_at_a_time_);
    random_ = Random(seed);
    kept_ = false;
  }

  [[nodiscard]] const PomcpOptions& options() const { return options_; }
  /// Bytes of the tree, whether used or not.
  [[nodiscard]] std::size_t memory() const { return tree_.bytes(); }

 private:
  static constexpr int BATCH = 256;  // states drawn from the belief at once

  struct Visit {
    std::uint32_t node;
    int action;
    double reward;
  };

  static void checkOptions(double deadline, int simulations, double exploration, int depth) {
    const auto refuse = [](const std::string& what) { throw ModelError("POMCP: " + what); };
    if (std::isnan(deadline) || deadline < 0.0) {
      refuse("deadline is " + std::to_string(deadline) + ", expected a number >= 0");
    }
    if (simulations < 0) refuse("max_simulations is " + std::to_string(simulations));
    if (!std::isfinite(exploration)) refuse("exploration is " + std::to_string(exploration));
    if (depth < 1) refuse("max_depth is " + std::to_string(depth) + ", expected >= 1");
  }

  void prepare(const Belief<State>& belief) {
    next_state_ = BATCH;
    const State state = drawState(belief);
    if (kept_ && tree_.isMostlyFree()) return;
    tree_.reset([&](int action) { return generative::legal(model_, state, action); });
  }

  State drawState(const Belief<State>& belief) {
    if (next_state_ == BATCH) {
      belief.sample(random_, BATCH, states_.data());
      next_state_ = 0;
    }
    return states_[static_cast<std::size_t>(next_state_++)];
  }

  /// False when time ran out; an unfinished simulation leaves no trace but its new history.
  bool simulate(const Belief<State>& belief, SearchClock& clock) {
    if (clock.expired()) return false;
    State state = drawState(belief);
    std::uint32_t node = tree_.root();
    std::size_t depth = 0;
    double beyond = 0.0;
    while (depth < path_.size()) {
      if (!clock.spend(1)) return false;
      const int action = tree_.choose(node, exploration_);
      const Step step = model_.step(state, action, random_.uniform());
      path_[depth++] = {node, action, step.reward};
      if (step.terminal) break;
      const auto child = tree_.child(node, action, step.observation,
                                     [&](int a) { return generative::legal(model_, state, a); });
      node = child.node;
      if (child.known) continue;
      if (!rollOut(state, depth, clock, beyond)) return false;
      break;
    }
    backUp(depth, beyond);
    return true;
  }

  bool rollOut(State& state, std::size_t depth, SearchClock& clock, double& value) {
    double weight = 1.0;
    value = 0.0;
    for (; depth < path_.size(); ++depth) {
      if (!clock.spend(1)) return false;
      const Step step = model_.step(state, rolloutAction(state), random_.uniform());
      value += weight * step.reward;
      if (step.terminal) break;
      weight *= model_.discount();
    }
    return true;
  }

  int rolloutAction(const State& state) {
    if constexpr (generative::HAS_DEFAULT_ACTION<Model>) {
      if (default_rollout_) return model_.defaultAction(&state, 1);
    }
    const int actions = model_.numActions();
    const int first = random_.below(actions);
    for (int i = 0; i < actions; ++i) {
      const int action = (first + i) % actions;
      if (generative::legal(model_, state, action)) return action;
    }
    return first;
  }

  void backUp(std::size_t depth, double beyond) {
    double value = beyond;
    while (depth-- > 0) {
      const Visit& visit = path_[depth];
      value = visit.reward + model_.discount() * value;
      tree_.record(visit.node, visit.action, value);
    }
  }

  Decision choose() {
    Decision decision;
    const auto best = tree_.bestActions();
    decision.nodes = static_cast<int>(tree_.size());
    decision.lower_bound = -std::numeric_limits<double>::infinity();
    decision.upper_bound = std::numeric_limits<double>::infinity();
    decision.fallback_used = best.first < 0;
    decision.action = best.first < 0 ? rolloutAction(states_[0]) : best.first;
    decision.value = best.first < 0 ? decision.lower_bound : best.value;
    decision.runner_up = best.second;
    decision.runner_up_gap = best.gap;
    return decision;
  }

  const Model& model_;
  PomcpOptions options_;
  HistoryTree tree_;
  Random random_;
  double exploration_ = 0.0;
  bool default_rollout_ = false;
  bool kept_ = false;
  int next_state_ = BATCH;
  std::vector<State> states_;
  std::vector<Visit> path_;
  std::mutex one_at_a_time_;
};

}  // namespace fabric::planner

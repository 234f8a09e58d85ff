// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/online_planner.hpp"

#include <cmath>
#include <limits>

#include "search_tree.hpp"
#include "stopwatch.hpp"

namespace fabric::planner {
namespace {

constexpr double EQUAL = 1e-9;         // values closer than this are a tie
constexpr double EXACT_ENOUGH = 1e-9;  // of a belief's sum
constexpr double LOWEST = -std::numeric_limits<double>::infinity();

PlannerOptions checked(PlannerOptions options) {
  const auto refuse = [](const char* name, double value) {
    throw ModelError(std::string("planner option ") + name + " is " + std::to_string(value) +
                     ", expected a finite number not below 0");
  };
  if (!std::isfinite(options.deadline) || options.deadline < 0.0) {
    refuse("deadline", options.deadline);
  }
  if (!std::isfinite(options.gap) || options.gap < 0.0) refuse("gap", options.gap);
  if (options.max_nodes < 0) refuse("max_nodes", options.max_nodes);
  return options;
}

void checkVectors(const Pomdp& model, const char* which, const AlphaVectors& bound) {
  const auto& vectors = bound.vectors;
  if (vectors.rows() == 0 || vectors.cols() != model.numStates()) {
    throw ModelError(model.name() + ": the " + which + " bound is of shape (" +
                     std::to_string(vectors.rows()) + ", " + std::to_string(vectors.cols()) +
                     "), expected at least one vector of " + std::to_string(model.numStates()));
  }
  if (!vectors.allFinite()) {
    throw ModelError(model.name() + ": the " + which + " bound has an entry that is not finite");
  }
  if (bound.actions.size() != static_cast<size_t>(vectors.rows())) {
    throw ModelError(model.name() + ": the " + which + " bound has " +
                     std::to_string(bound.actions.size()) + " actions for " +
                     std::to_string(vectors.rows()) + " vectors");
  }
  for (const int action : bound.actions) model.checkAction(action);
}

}  // namespace

AlphaVectors preparedLowerBound(const Pomdp& model, const PlannerOptions& options) {
  if (options.preparation == Preparation::THOROUGH) return pointBasedBound(model);
  return pointBasedBound(model, PointBasedOptions::quick());
}

PointUpperBound preparedUpperBound(const Pomdp& model, const PlannerOptions& options) {
  if (options.preparation == Preparation::THOROUGH) return pointBasedUpperBound(model);
  return PointUpperBound(fastInformedBound(model));
}

OnlinePlanner::OnlinePlanner(std::shared_ptr<const Pomdp> model, PlannerOptions options)
    : OnlinePlanner(model, checked(options), preparedLowerBound(*model, options),
                    preparedUpperBound(*model, options)) {}

OnlinePlanner::OnlinePlanner(std::shared_ptr<const Pomdp> model, PlannerOptions options,
                             AlphaVectors lower, PointUpperBound upper)
    : model_(std::move(model)),
      options_(checked(options)),
      lower_(std::move(lower)),
      upper_(std::move(upper)),
      action_lower_(model_->numActions()),
      action_upper_(model_->numActions()) {
  checkVectors(*model_, "lower", lower_);
  checkVectors(*model_, "upper", upper_.base());
  tree_ = std::make_unique<SearchTree>(*model_, lower_, upper_, options_.max_nodes);
}

OnlinePlanner::~OnlinePlanner() = default;

/// A belief that needs no rescaling, and hence no memory.
bool OnlinePlanner::isUsable(const Eigen::VectorXd& belief) const {
  return belief.size() == model_->numStates() && (belief.array() >= 0.0).all() &&
         std::abs(belief.sum() - 1.0) <= EXACT_ENOUGH;
}

Decision OnlinePlanner::decide(const Eigen::VectorXd& belief) {
  if (!isUsable(belief)) {
    const Eigen::VectorXd rescaled = model_->checkedBelief(belief);
    return decide(rescaled / rescaled.sum());
  }
  const std::lock_guard<std::mutex> lock(one_at_a_time_);
  Stopwatch watch(options_.deadline);
  if (!tree_->isAt(belief)) tree_->start(belief);
  Decision decision;
  decision.kept_nodes = tree_->expanded();
  decision.ended_by = search(watch);
  decision.nodes = tree_->expanded();
  decision.fallback_used = decision.nodes == 0;
  boundActions(belief);
  choose(decision);
  decision.lower_bound = tree_->lower();
  decision.upper_bound = tree_->upper();
  decision.planning_time = watch.elapsed();
  decision.deadline_missed = decision.planning_time > options_.deadline;
  return decision;
}

void OnlinePlanner::advance(int action, int observation) {
  model_->checkAction(action);
  model_->checkObservation(observation);
  const std::lock_guard<std::mutex> lock(one_at_a_time_);
  tree_->advance(action, observation);
}

void OnlinePlanner::reset() {
  const std::lock_guard<std::mutex> lock(one_at_a_time_);
  tree_->clear();
}

std::vector<TreeEntry> OnlinePlanner::tree(int max_depth, double min_probability) const {
  const std::lock_guard<std::mutex> lock(one_at_a_time_);
  return tree_->describe(max_depth, min_probability);
}

EndedBy OnlinePlanner::search(Stopwatch& watch) {
  for (;;) {
    if (tree_->expanded() > 0 &&
        (tree_->upper() - tree_->lower() <= options_.gap || tree_->exhausted())) {
      return EndedBy::GAP;
    }
    if (tree_->expanded() >= options_.max_nodes) return EndedBy::NODES;
    if (!tree_->grow(watch)) return EndedBy::DEADLINE;
  }
}

/// A vector's own action is worth what the vector says, even where the search says less.
void OnlinePlanner::boundActions(const Eigen::VectorXd& belief) {
  action_lower_.setConstant(LOWEST);
  for (Eigen::Index k = 0; k < lower_.vectors.rows(); ++k) {
    double& entry = action_lower_(lower_.actions[static_cast<size_t>(k)]);
    entry = std::max(entry, lower_.vectors.row(k).dot(belief));
  }
  action_upper_.setConstant(LOWEST);
  const AlphaVectors& base = upper_.base();
  for (Eigen::Index k = 0; k < base.vectors.rows(); ++k) {
    double& entry = action_upper_(base.actions[static_cast<size_t>(k)]);
    entry = std::max(entry, base.vectors.row(k).dot(belief));
  }
  const bool searched = tree_->expanded() > 0;
  for (int a = 0; a < model_->numActions(); ++a) {
    if (searched) {
      action_lower_(a) = std::max(action_lower_(a), tree_->actionLower(a));
      action_upper_(a) = tree_->actionUpper(a);
    }
    if (!model_->isAllowed(a, belief)) action_lower_(a) = LOWEST;
  }
}

/// Best lower bound; among equals the best upper bound, then the lowest index. -1 if none is left.
int OnlinePlanner::bestAction(int without) const {
  const auto& lower = action_lower_;
  const auto& upper = action_upper_;
  int best = -1;
  for (int a = 0; a < lower.size(); ++a) {
    if (a == without || !std::isfinite(lower(a))) continue;
    const bool better = best < 0 || lower(a) > lower(best) + EQUAL ||
                        (lower(a) > lower(best) - EQUAL && upper(a) > upper(best) + EQUAL);
    if (better) best = a;
  }
  return best;
}

void OnlinePlanner::choose(Decision& decision) const {
  decision.action = bestAction(-1);
  if (decision.action < 0) {
    throw ModelError(model_->name() + ": no action is allowed in every state that is possible");
  }
  decision.value = action_lower_(decision.action);
  decision.runner_up = bestAction(decision.action);
  if (decision.runner_up >= 0) {
    decision.runner_up_gap = std::max(0.0, decision.value - action_lower_(decision.runner_up));
  }
}

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/online_planner.hpp"

#include <cmath>
#include <limits>

#include "search_tree.hpp"

namespace fabric::planner {
namespace {

constexpr double EQUAL = 1e-9;  // values closer than this are a tie

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

/// (A,): the best offline vector that begins with each action; -inf where there is none.
Eigen::VectorXd offlineLower(const AlphaVectors& bound, int actions,
                             const Eigen::VectorXd& belief) {
  const Eigen::VectorXd values = bound.vectors * belief;
  Eigen::VectorXd best =
      Eigen::VectorXd::Constant(actions, -std::numeric_limits<double>::infinity());
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    double& entry = best(bound.actions[static_cast<size_t>(k)]);
    entry = std::max(entry, values(k));
  }
  return best;
}

/// Best lower bound; among equals the best upper bound, then the lowest index. -1 if none is left.
int bestAction(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, int without) {
  int best = -1;
  for (int a = 0; a < lower.size(); ++a) {
    if (a == without || !std::isfinite(lower(a))) continue;
    const bool better = best < 0 || lower(a) > lower(best) + EQUAL ||
                        (lower(a) > lower(best) - EQUAL && upper(a) > upper(best) + EQUAL);
    if (better) best = a;
  }
  return best;
}

void choose(const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, Decision& decision) {
  decision.action = bestAction(lower, upper, -1);
  decision.value = lower(decision.action);
  decision.runner_up = bestAction(lower, upper, decision.action);
  if (decision.runner_up >= 0) {
    decision.runner_up_gap = std::max(0.0, decision.value - lower(decision.runner_up));
  }
}

EndedBy search(SearchTree& tree, const PlannerOptions& options, Stopwatch& watch) {
  for (;;) {
    if (tree.expanded() > 0 && (tree.upper() - tree.lower() <= options.gap || tree.exhausted())) {
      return EndedBy::GAP;
    }
    if (tree.expanded() >= options.max_nodes) return EndedBy::NODES;
    if (!tree.grow(watch)) return EndedBy::DEADLINE;
  }
}

}  // namespace

OnlinePlanner::OnlinePlanner(std::shared_ptr<const Pomdp> model, PlannerOptions options)
    : model_(std::move(model)),
      options_(checked(options)),
      lower_(pointBasedBound(*model_)),
      upper_(pointBasedUpperBound(*model_)),
      tree_(std::make_unique<SearchTree>(*model_, lower_, upper_, options_.max_nodes)) {}

OnlinePlanner::~OnlinePlanner() = default;

Decision OnlinePlanner::decide(const Eigen::VectorXd& belief) {
  const std::lock_guard<std::mutex> lock(one_at_a_time_);
  Stopwatch watch(options_.deadline);
  const Eigen::VectorXd root = model_->checkedBelief(belief);
  tree_->start(root);
  Decision decision;
  decision.ended_by = search(*tree_, options_, watch);
  decision.nodes = tree_->expanded();
  decision.fallback_used = decision.nodes == 0;
  // A vector's own action is worth what the vector says, even where the search says less.
  Eigen::VectorXd lower = offlineLower(lower_, model_->numActions(), root);
  Eigen::VectorXd upper = upper_.base().vectors * root;
  if (!decision.fallback_used) {
    lower = lower.cwiseMax(tree_->actionLower());
    upper = tree_->actionUpper();
  }
  choose(lower, upper, decision);
  decision.lower_bound = tree_->lower();
  decision.upper_bound = tree_->upper();
  decision.planning_time = watch.elapsed();
  decision.deadline_missed = decision.planning_time > options_.deadline;
  return decision;
}

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/decision_agent.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <utility>

#include "fabric_planner/model_file.hpp"
#include "fabric_planner/policy_file.hpp"
#include "file.hpp"

namespace fabric::planner {
namespace {

std::string mapBeside(const std::string& path) {
  return std::filesystem::path(path).replace_extension(".obs.yaml").string();
}

std::string hashOf(const std::string& path, const std::string& map_path) {
  std::string bytes = readFile(path);
  bytes += readFile(map_path.empty() ? mapBeside(path) : map_path);
  return sha256(bytes);
}

std::vector<Action> canonicalActions(const Pomdp& pomdp, const std::string& path) {
  std::vector<Action> actions;
  for (const std::string& name : pomdp.actions()) {
    try {
      actions.push_back(actionFromName(name));
    } catch (const ModelError& error) {
      throw ModelError(path + ": " + error.what());
    }
  }
  return actions;
}

void checkNumbers(const AgentObservation& observation) {
  const Features& features = observation.features;
  for (const auto& [name, value] : std::initializer_list<std::pair<const char*, double>>{
           {"subtask_elapsed", features.subtask_elapsed},
           {"waiting_time", features.waiting_time},
           {"failed_attempts", features.failed_attempts}}) {
    if (std::isfinite(value)) continue;
    throw ModelError("observation " + std::to_string(observation.sequence) + ": " + name +
                     (std::isnan(value) ? " is NaN" : " is infinite"));
  }
}

template <class T>
std::optional<int> find(const std::vector<T>& items, const T& wanted) {
  const auto found = std::find(items.begin(), items.end(), wanted);
  if (found == items.end()) return std::nullopt;
  return static_cast<int>(found - items.begin());
}

std::optional<AlphaVectors> policyOf(const AgentOptions& options, const Pomdp& pomdp) {
  if (options.policy_path.empty()) return options.policy;
  return loadPolicy(options.policy_path, pomdp);
}

/// Search and vectors have a policy before they look at anything.
bool hasOfflinePolicy(SolverKind kind) {
  return kind == SolverKind::SEARCH || kind == SolverKind::OFFLINE;
}

}  // namespace

RunningModel::RunningModel(const std::string& model_path, const std::string& map_path,
                           const AgentOptions& options)
    : path(model_path),
      name(std::filesystem::path(model_path).stem().string()),
      pomdp(std::make_shared<const Pomdp>(loadModel(model_path))),
      map(ObservationMap::load(map_path.empty() ? mapBeside(model_path) : map_path,
                               pomdp->observations())),
      actions(canonicalActions(*pomdp, model_path)),
      solver(makeSolver(options.solver, pomdp, options.planner, policyOf(options, *pomdp),
                        options.seed)) {
  if (options.fallback && !find(actions, *options.fallback)) {
    throw ModelError(path + ": has no action for the fallback, " + actionName(*options.fallback));
  }
  hash = hashOf(path, map_path);
}

int RunningModel::indexOf(Action action) const {
  return find(actions, action).value_or(find(actions, Action::IDLE).value_or(0));
}

DecisionAgent::DecisionAgent(const std::string& path, AgentOptions options,
                             const std::string& map_path)
    : options_(std::move(options)),
      model_(std::make_shared<RunningModel>(path, map_path, options_)) {
  options_.policy.reset();
  options_.policy_path.clear();
  known_[model_->path + model_->hash] = model_;
  filter_ = std::make_unique<BeliefFilter>(model_->pomdp);
}

void DecisionAgent::reset() {
  filter_->reset();
  model_->solver->reset();
  last_action_.reset();
  last_symbol_.reset();
  task_id_.reset();
}

std::shared_ptr<RunningModel> DecisionAgent::prepared(const std::string& path,
                                                      const std::string& map_path) {
  const auto found = known_.find(path + hashOf(path, map_path));
  if (found != known_.end()) {
    found->second->solver->reset();
    return found->second;
  }
  auto fresh = std::make_shared<RunningModel>(path, map_path, options_);
  known_[path + fresh->hash] = fresh;
  return fresh;
}

void DecisionAgent::setModel(const std::string& path, bool keep_belief,
                             const std::string& map_path) {
  std::shared_ptr<RunningModel> next = prepared(path, map_path);
  const std::optional<Eigen::VectorXd> belief = keep_belief ? carriedOver(*next) : std::nullopt;
  if (last_symbol_) {
    last_symbol_ = find(next->pomdp->observations(), model_->pomdp->observations()[*last_symbol_]);
  }
  model_ = std::move(next);
  filter_ = std::make_unique<BeliefFilter>(model_->pomdp);
  if (belief) filter_->reset(*belief);
  if (!keep_belief) reset();
}

std::optional<Eigen::VectorXd> DecisionAgent::carriedOver(const RunningModel& next) const {
  const std::vector<std::string>& before = model_->pomdp->states();
  Eigen::VectorXd belief = Eigen::VectorXd::Zero(next.pomdp->numStates());
  for (int s = 0; s < next.pomdp->numStates(); ++s) {
    if (const auto old = find(before, next.pomdp->states()[s])) belief[s] = filter_->belief()[*old];
  }
  const double total = belief.sum();
  if (!(total > 0.0)) return std::nullopt;
  return belief / total;
}

AgentDecision DecisionAgent::decide(const AgentObservation& observation) {
  checkNumbers(observation);
  if (observation.starts_task || (task_id_ && *task_id_ != observation.task_id)) reset();
  task_id_ = observation.task_id;

  AgentDecision decision;
  decision.observation_sequence = observation.sequence;
  decision.task_id = observation.task_id;
  decision.model_hash = model_->hash;
  decision.observation_index = model_->map.symbol(observation.features, last_symbol_);
  decision.belief_recovered = observe(decision.observation_index) == UpdateStatus::RECOVERED;
  decision.belief = filter_->belief();
  decision.plan = plan(decision.trouble);
  decision.action_index = decision.plan.action;
  decision.action = model_->actions[decision.action_index];
  last_symbol_ = decision.observation_index;
  last_action_ = decision.action;
  return decision;
}

Decision DecisionAgent::plan(std::string& trouble) {
  if (!options_.fallback) return model_->solver->decide(filter_->belief());
  Decision decision;
  try {
    decision = model_->solver->decide(filter_->belief());
    if (!decision.fallback_used || hasOfflinePolicy(options_.solver)) return decision;
    trouble = "no time to search";
  } catch (const std::exception& error) {
    trouble = error.what();
    decision = Decision();
    decision.fallback_used = true;
  }
  decision.action = model_->indexOf(*options_.fallback);
  decision.runner_up = -1;
  decision.runner_up_gap = 0.0;
  return decision;
}

UpdateStatus DecisionAgent::observe(int symbol) {
  if (!last_action_) return weigh(symbol);
  const int action = model_->indexOf(*last_action_);
  model_->solver->advance(action, symbol);
  return filter_->update(action, symbol);
}

/// b(s) ~ b0(s) O(idle, s, symbol); an impossible symbol is dealt with as BeliefFilter does.
UpdateStatus DecisionAgent::weigh(int symbol) {
  const Eigen::VectorXd likelihood = model_->pomdp->O(model_->indexOf(Action::IDLE)).col(symbol);
  const Eigen::VectorXd weighted = filter_->belief().cwiseProduct(likelihood);
  if (weighted.sum() > 0.0) {
    filter_->reset(weighted / weighted.sum());
    return UpdateStatus::OK;
  }
  if (likelihood.sum() > 0.0) filter_->reset(likelihood / likelihood.sum());
  return UpdateStatus::RECOVERED;
}

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "fabric_planner/actions.hpp"
#include "fabric_planner/belief_filter.hpp"
#include "fabric_planner/decision_solver.hpp"
#include "fabric_planner/features.hpp"
#include "fabric_planner/observation_map.hpp"
#include "fabric_planner/online_planner.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// One observation, as in fabric_msgs/Observation.
struct AgentObservation {
  Features features;
  std::uint32_t sequence = 0;
  std::uint32_t task_id = 0;
  bool starts_task = false;  ///< TRIGGER_START
};

/// The fields of fabric_msgs/Decision.
struct AgentDecision {
  std::uint32_t observation_sequence = 0;
  std::uint32_t task_id = 0;
  std::string model_hash;
  Action action = Action::IDLE;
  int action_index = 0;       ///< the same action as the model numbers it
  int observation_index = 0;  ///< the model's symbol
  Eigen::VectorXd belief;     ///< (S,), sums to 1, after the observation
  Decision plan;              ///< value, bounds, runner-up and the search's own figures
  bool belief_recovered = false;
  std::string trouble;  ///< why the fallback was taken, else empty
};

/// How an agent decides.
struct AgentOptions {
  AgentOptions() = default;
  AgentOptions(PlannerOptions limits) : planner(limits) {}  // NOLINT: options with defaults

  PlannerOptions planner;
  SolverKind solver = SolverKind::SEARCH;
  /// Vectors for the agent's first model; see makeSolver(). Models set later go without.
  std::optional<AlphaVectors> policy;
  std::string policy_path;  ///< a .policy file with such vectors; empty: `policy` as it is
  /// Taken when a decision cannot be found: the solver fails, or has neither searched nor a policy
  /// of its own. Each model must have it. None: errors go to the caller, and DESPOT and POMCP
  /// answer with their default policy.
  std::optional<Action> fallback;
  std::uint64_t seed = 1;  ///< of the draws of DESPOT and POMCP
};

/// A model with everything that runs it; immutable but for the solver's search.
struct RunningModel {
  /// @param map_path observation map; empty: `<stem of path>.obs.yaml` beside the model
  /// @throw ModelError naming the file and what is wrong with it, also for actions that are
  ///        none of the robot's and when it lacks the fallback.
  RunningModel(const std::string& path, const std::string& map_path, const AgentOptions& options);

  /// The model's index of an action; of idle when it has no such action, 0 when not even that.
  [[nodiscard]] int indexOf(Action action) const;

  std::string path;
  std::string name;  ///< of the file, without its extension
  std::string hash;  ///< SHA-256 of the bytes of the model file followed by those of the map
  std::shared_ptr<const Pomdp> pomdp;
  ObservationMap map;
  std::vector<Action> actions;  ///< by the model's index
  std::unique_ptr<DecisionSolver> solver;
};

/// From observations to decisions: observation map, belief, solver.
///
/// The solver goes on from one decision to the next and begins afresh with every task, so that a
/// task does not depend on the one before. The belief starts again with every task. The first
/// observation of a task says what the world is like before the robot did anything, so it weighs
/// the initial belief by its likelihood; every later one is an update with the robot's last
/// decision. Not for several threads at once.
class DecisionAgent {
 public:
  /// @throw ModelError as RunningModel does.
  explicit DecisionAgent(const std::string& path, AgentOptions options = {},
                         const std::string& map_path = "");

  /// A new task: the initial belief, and nothing decided yet.
  void reset();

  /// Runs another model from now on. A model that ran before and whose files are as they were needs
  /// no preparation again. With `keep_belief` the belief goes over by state name, what
  /// lies on states that the new model lacks is shared out in proportion, and a belief without
  /// any common state starts again. When the model is refused the present one stays.
  /// @throw ModelError as RunningModel does.
  void setModel(const std::string& path, bool keep_belief, const std::string& map_path = "");

  /// @throw ModelError when a number of the observation is NaN or infinite, or when no decision
  /// can be found and there is no fallback.
  AgentDecision decide(const AgentObservation& observation);

  [[nodiscard]] const RunningModel& model() const { return *model_; }
  /// (S,), sums to 1.
  [[nodiscard]] const Eigen::VectorXd& belief() const { return filter_->belief(); }

 private:
  [[nodiscard]] std::shared_ptr<RunningModel> prepared(const std::string& path,
                                                       const std::string& map_path);
  [[nodiscard]] Decision plan(std::string& trouble);
  UpdateStatus observe(int symbol);
  UpdateStatus weigh(int symbol);
  [[nodiscard]] std::optional<Eigen::VectorXd> carriedOver(const RunningModel& next) const;

  AgentOptions options_;
  std::shared_ptr<RunningModel> model_;
  std::map<std::string, std::shared_ptr<RunningModel>> known_;  ///< by path and hash
  std::unique_ptr<BeliefFilter> filter_;
  std::optional<Action> last_action_;
  std::optional<int> last_symbol_;
  std::optional<std::uint32_t> task_id_;
};

}  // namespace fabric::planner

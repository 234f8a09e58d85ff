// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <regex>

#include "fabric_planner/decision_agent.hpp"
#include "fabric_planner/model_file.hpp"
#include "fabric_planner/policy_file.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

const std::string MODELS = std::string(PACKAGE_DIR) + "/test/models/";
const std::string HELPER = MODELS + "helper.pomdpx";

PlannerOptions quick() { return {10.0, 1e-3, 200}; }

AgentObservation observe(std::uint32_t sequence, bool idle, bool starts_task = false) {
  AgentObservation observation;
  observation.features.detected = true;
  observation.features.idle = idle;
  observation.sequence = sequence;
  observation.task_id = 1;
  observation.starts_task = starts_task;
  return observation;
}

TEST(DecisionAgent, WeighsTheInitialBeliefWithTheFirstObservation) {
  DecisionAgent agent(HELPER, quick());
  const AgentDecision decision = agent.decide(observe(1, true, true));
  // (0.75 * 0.5, 0.25 * 0.9) normalised; no transition has happened yet.
  EXPECT_NEAR(decision.belief[0], 0.375 / 0.6, 1e-12);
  EXPECT_NEAR(decision.belief[1], 0.225 / 0.6, 1e-12);
  EXPECT_EQ(decision.observation_index, 1);
  EXPECT_FALSE(decision.belief_recovered);
}

TEST(DecisionAgent, UpdatesLaterWithTheActionItDecidedBefore) {
  DecisionAgent agent(HELPER, quick());
  const AgentDecision first = agent.decide(observe(1, true, true));
  const AgentDecision second = agent.decide(observe(2, true));
  ASSERT_EQ(first.action, Action::IDLE);
  const double fine = 0.8 * first.belief[0] * 0.5;
  const double stuck = (first.belief[1] + 0.2 * first.belief[0]) * 0.9;
  EXPECT_NEAR(second.belief[0], fine / (fine + stuck), 1e-12);
  EXPECT_EQ(second.observation_sequence, 2U);
}

TEST(DecisionAgent, StartsAgainWithEveryTask) {
  DecisionAgent agent(HELPER, quick());
  const AgentDecision first = agent.decide(observe(1, true, true));
  agent.decide(observe(2, true));
  AgentObservation other = observe(3, true);
  other.task_id = 2;
  EXPECT_EQ(agent.decide(other).belief, first.belief) << "another task id";
  agent.decide(other);
  other.starts_task = true;
  EXPECT_EQ(agent.decide(other).belief, first.belief) << "the trigger of a start";
}

TEST(DecisionAgent, RecoversFromAnImpossibleObservation) {
  DecisionAgent agent(HELPER, quick());
  AgentObservation observation = observe(1, false, true);
  observation.features.warning = true;
  const AgentDecision first = agent.decide(observation);
  EXPECT_TRUE(first.belief_recovered);
  EXPECT_NEAR(first.belief[0], 0.75, 1e-12);
  observation.starts_task = false;
  const AgentDecision second = agent.decide(observation);
  EXPECT_TRUE(second.belief_recovered);
  EXPECT_NEAR(second.belief.sum(), 1.0, 1e-12);
}

TEST(DecisionAgent, HelpsWhoIsStuckAndLetsAloneWhoIsFine) {
  DecisionAgent agent(HELPER, quick());
  EXPECT_EQ(agent.decide(observe(1, false, true)).action, Action::IDLE);
  Action action = Action::IDLE;
  for (std::uint32_t i = 2; i < 12 && action == Action::IDLE; ++i) {
    action = agent.decide(observe(i, true)).action;
  }
  EXPECT_EQ(action, Action::GRASP);
}

TEST(DecisionAgent, FillsInWhatADecisionHolds) {
  DecisionAgent agent(HELPER, quick());
  const AgentDecision decision = agent.decide(observe(5, true, true));
  EXPECT_EQ(decision.task_id, 1U);
  EXPECT_EQ(decision.model_hash, agent.model().hash);
  EXPECT_TRUE(std::regex_match(decision.model_hash, std::regex("[0-9a-f]{64}")));
  EXPECT_LE(decision.plan.lower_bound, decision.plan.upper_bound + 1e-9);
  EXPECT_EQ(agent.model().actions[decision.action_index], decision.action);
}

TEST(DecisionAgent, RefusesNumbersThatAreNotFinite) {
  DecisionAgent agent(HELPER, quick());
  AgentObservation observation = observe(5, true, true);
  observation.features.subtask_elapsed = std::nan("");
  try {
    agent.decide(observation);
    FAIL() << "accepted";
  } catch (const ModelError& error) {
    EXPECT_STREQ(error.what(), "observation 5: subtask_elapsed is NaN");
  }
  observation.features.subtask_elapsed = std::numeric_limits<double>::infinity();
  EXPECT_THROW(agent.decide(observation), ModelError);
}

TEST(DecisionAgent, ATaskDoesNotDependOnTheOneBefore) {
  for (const SolverKind kind : {SolverKind::SEARCH, SolverKind::DESPOT, SolverKind::POMCP}) {
    AgentOptions options(quick());
    options.solver = kind;
    DecisionAgent agent(HELPER, options);
    std::vector<AgentDecision> first;
    for (std::uint32_t task = 1; task < 4; ++task) {
      for (std::uint32_t i = 0; i < 6; ++i) {
        AgentObservation observation = observe(i, i % 2 == 0, i == 0);
        observation.task_id = task;
        const AgentDecision decision = agent.decide(observation);
        if (task == 1) {
          first.push_back(decision);
        } else {
          EXPECT_EQ(decision.action, first[i].action);
          EXPECT_EQ(decision.plan.value, first[i].plan.value);
          EXPECT_EQ(decision.plan.kept_nodes, first[i].plan.kept_nodes);
        }
      }
    }
  }
}

TEST(DecisionAgent, KeepsWhatItSearchedFromOneObservationToTheNext) {
  DecisionAgent agent(HELPER, PlannerOptions{10.0, 0.0, 200});
  EXPECT_EQ(agent.decide(observe(1, true, true)).plan.kept_nodes, 0);
  EXPECT_GT(agent.decide(observe(2, true)).plan.kept_nodes, 0);
  EXPECT_EQ(agent.decide(observe(3, true, true)).plan.kept_nodes, 0) << "a new task";
}

TEST(Solvers, AllHelpWhoIsStuck) {
  for (const char* name : {"search", "offline", "despot", "pomcp"}) {
    AgentOptions options(PlannerOptions{10.0, 1e-3, 2000});
    options.solver = solverFromName(name);
    EXPECT_EQ(solverName(options.solver), name);
    DecisionAgent agent(HELPER, options);
    Action action = agent.decide(observe(1, false, true)).action;
    for (std::uint32_t i = 2; i < 12 && action == Action::IDLE; ++i) {
      action = agent.decide(observe(i, true)).action;
    }
    EXPECT_EQ(action, Action::GRASP) << name;
  }
  EXPECT_THROW(solverFromName("magic"), ModelError);
}

TEST(Solvers, OfflineRunsThePolicyItIsGivenAndNothingElse) {
  AgentOptions options(quick());
  options.solver = SolverKind::OFFLINE;
  const int cancel = DecisionAgent(HELPER).model().indexOf(Action::CANCEL);
  options.policy = AlphaVectors{Eigen::MatrixXd::Constant(1, 2, -50.0), {cancel}};
  DecisionAgent agent(HELPER, options);
  const AgentDecision decision = agent.decide(observe(1, true, true));
  EXPECT_EQ(decision.action, Action::CANCEL);
  EXPECT_EQ(decision.plan.value, -50.0);
  EXPECT_EQ(decision.plan.nodes, 0);
  EXPECT_FALSE(decision.plan.fallback_used);
  options.policy->vectors = Eigen::MatrixXd::Zero(1, 5);
  EXPECT_THROW(DecisionAgent(HELPER, options), ModelError);
}

TEST(Solvers, APolicyFileIsForTheFirstModelOnly) {
  AgentOptions options(quick());
  options.solver = SolverKind::OFFLINE;
  options.policy_path = std::string(::testing::TempDir()) + "first.policy";
  const Pomdp model = loadModel(HELPER);
  savePolicy({Eigen::MatrixXd::Constant(1, 2, -50.0), {model.actionIndex("cancel")}}, model,
             options.policy_path);
  DecisionAgent agent(HELPER, options);
  EXPECT_EQ(agent.decide(observe(1, true, true)).action, Action::CANCEL);
  agent.setModel(MODELS + "other_states.pomdpx", false);
  EXPECT_GT(agent.decide(observe(2, true)).plan.value, -50.0);
  options.policy_path = "/nowhere/first.policy";
  EXPECT_THROW(DecisionAgent(HELPER, options), ModelError);
}

TEST(Solvers, SearchCountsOnAPolicyAsALowerBound) {
  AgentOptions options(PlannerOptions{10.0, 0.0, 0});
  options.policy = AlphaVectors{Eigen::MatrixXd::Constant(1, 2, 1000.0), {0}};
  EXPECT_EQ(DecisionAgent(HELPER, options).decide(observe(1, true, true)).plan.value, 1000.0);
}

TEST(Fallback, IsTakenWhenNothingWasSearched) {
  for (const SolverKind kind : {SolverKind::DESPOT, SolverKind::POMCP}) {
    AgentOptions options(PlannerOptions{0.0, 1e-3, 100});
    options.solver = kind;
    options.fallback = Action::CANCEL;
    DecisionAgent agent(HELPER, options);
    const AgentDecision decision = agent.decide(observe(1, true, true));
    EXPECT_EQ(decision.action, Action::CANCEL);
    EXPECT_TRUE(decision.plan.fallback_used);
    EXPECT_FALSE(decision.trouble.empty());
  }
}

TEST(Fallback, IsNotTakenWhereAnOfflinePolicyAnswers) {
  AgentOptions options(PlannerOptions{0.0, 1e-3, 100});
  options.fallback = Action::CANCEL;
  const AgentDecision decision = DecisionAgent(HELPER, options).decide(observe(1, true, true));
  EXPECT_EQ(decision.action, Action::IDLE);
  EXPECT_TRUE(decision.trouble.empty());
}

TEST(Fallback, MustBeAnActionOfEveryModel) {
  AgentOptions options(quick());
  options.fallback = Action::POINT;
  try {
    DecisionAgent agent(HELPER, options);
    FAIL() << "accepted";
  } catch (const ModelError& error) {
    EXPECT_EQ(error.what(), HELPER + ": has no action for the fallback, point");
  }
}

TEST(SetModel, CarriesTheBeliefOverByStateName) {
  DecisionAgent agent(HELPER, quick());
  agent.decide(observe(1, true, true));
  const double stuck = agent.belief()[1];
  ASSERT_GT(stuck, 0.0);
  agent.setModel(MODELS + "other_states.pomdpx", true);
  EXPECT_EQ(agent.model().name, "other_states");
  EXPECT_NEAR(agent.belief()[0], 1.0, 1e-12) << "only stuck is known to both";
  agent.setModel(HELPER, false);
  EXPECT_NEAR(agent.belief()[0], 0.75, 1e-12) << "the initial belief";
}

TEST(SetModel, KeepsThePresentModelWhenTheNewOneIsRefused) {
  DecisionAgent agent(HELPER, quick());
  agent.decide(observe(1, true, true));
  const Eigen::VectorXd belief = agent.belief();
  const std::string reason =
      testing::refusal([&] { agent.setModel("/nowhere/model.pomdpx", true); });
  EXPECT_NE(reason.find("/nowhere/model.pomdpx"), std::string::npos) << reason;
  EXPECT_EQ(agent.model().name, "helper");
  EXPECT_EQ(agent.belief(), belief);
}

TEST(SetModel, NeedsNoPreparationForAModelThatRanBefore) {
  DecisionAgent agent(HELPER, quick());
  const Pomdp* first = agent.model().pomdp.get();
  agent.setModel(MODELS + "other_states.pomdpx", false);
  agent.setModel(HELPER, false);
  EXPECT_EQ(agent.model().pomdp.get(), first);
  const AgentDecision again = agent.decide(observe(1, true, true));
  const AgentDecision fresh = DecisionAgent(HELPER, quick()).decide(observe(1, true, true));
  EXPECT_EQ(again.action, fresh.action);
  EXPECT_EQ(again.plan.value, fresh.plan.value);
  EXPECT_EQ(again.plan.nodes, fresh.plan.nodes);
}

TEST(SetModel, ReadsAFileAgainThatWasChanged) {
  const std::filesystem::path folder = ::testing::TempDir() + "set_model";
  std::filesystem::create_directories(folder);
  const std::string model = folder / "changing.pomdpx";
  const auto put = [&](const std::string& name) {
    const auto over = std::filesystem::copy_options::overwrite_existing;
    std::filesystem::copy_file(MODELS + name + ".pomdpx", model, over);
    std::filesystem::copy_file(MODELS + name + ".obs.yaml", folder / "changing.obs.yaml", over);
  };
  put("helper");
  DecisionAgent agent(model, quick());
  put("other_states");
  agent.setModel(model, false);
  EXPECT_EQ(agent.model().hash,
            DecisionAgent(MODELS + "other_states.pomdpx", quick()).model().hash);
  std::filesystem::remove_all(folder);
}

TEST(SetModel, RefusesAModelWithoutItsMapOrWithActionsOfOthers) {
  EXPECT_THROW(DecisionAgent(MODELS + "tiger.pomdpx", quick()), ModelError);
  EXPECT_THROW(DecisionAgent(HELPER, quick(), "/nowhere/map.obs.yaml"), ModelError);
  EXPECT_THROW(DecisionAgent(MODELS + "tiger.pomdpx", quick(), MODELS + "helper.obs.yaml"),
               ModelError);
}

TEST(ModelHash, IsTheSha256OfModelAndMap) {
  const std::string command =
      "cat " + HELPER + " " + MODELS + "helper.obs.yaml | sha256sum | cut -d' ' -f1";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  char text[80] = {};
  ASSERT_NE(fgets(text, sizeof text, pipe), nullptr);
  pclose(pipe);
  EXPECT_EQ(DecisionAgent(HELPER, quick()).model().hash + "\n", text);
}

}  // namespace
}  // namespace fabric::planner

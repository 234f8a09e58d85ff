// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <memory>

#include "any_model.hpp"
#include "bindings.hpp"
#include "fabric_planner/examples/laser_tag.hpp"
#include "fabric_planner/examples/rock_sample.hpp"
#include "fabric_planner/examples/tag.hpp"
#include "fabric_planner/examples/tiger.hpp"
#include "fabric_planner/tabular_model.hpp"

namespace py = pybind11;
using py::literals::operator""_a;

namespace fabric::planner {
namespace {

template <class Model, class... Arguments>
std::shared_ptr<AnyModel> make(Arguments... arguments) {
  return std::make_shared<ModelOf<Model>>(std::make_shared<const Model>(std::move(arguments)...));
}

std::shared_ptr<AnyModel> makeLaserTag(std::uint64_t layout_seed, double sigma, bool symmetric) {
  examples::LaserTagOptions options;
  options.layout_seed = layout_seed;
  options.sigma = sigma;
  options.noise = symmetric ? examples::ReadingNoise::SYMMETRIC : examples::ReadingNoise::SHORT;
  return make<examples::LaserTag>(options);
}

void bindModels(py::module_& module) {
  module.def("_tiger", &make<examples::Tiger>);
  module.def("_tag", &make<examples::Tag>);
  module.def("_rock_sample", &make<examples::RockSample, int, int>, "n"_a, "k"_a);
  module.def("_laser_tag", &makeLaserTag, "layout_seed"_a, "sigma"_a, "symmetric"_a);
  module.def(
      "_tabular_model",
      [](std::shared_ptr<Pomdp> pomdp) {
        py::gil_scoped_release release;
        return make<TabularModel>(std::shared_ptr<const Pomdp>(std::move(pomdp)));
      },
      "pomdp"_a);
  module.def(
      "_python_model", [](py::handle model) { return make<PythonModel>(model); }, "model"_a);
}

void bindRandom(py::module_& module) {
  py::class_<Random>(module, "Random", "A stream of random numbers, the same for a seed anywhere.")
      .def(py::init<std::uint64_t>(), "seed"_a)
      .def("uniform", &Random::uniform, "in [0, 1)")
      .def("normal", &Random::normal, "standard normal")
      .def(
          "below",
          [](Random& random, std::int64_t n) {
            if (n < 1 || n > 2147483647) {
              throw ModelError("below(" + std::to_string(n) + "), expected 1 to 2^31 - 1");
            }
            return random.below(static_cast<int>(n));
          },
          "n"_a, "an integer from 0 to n - 1");
  module.def("_random_of", &Random::of, "u"_a);
}

void bindDespotOptions(py::module_& module) {
  const DespotOptions standard;
  py::class_<DespotOptions>(module, "DespotOptions")
      .def(py::init([](double deadline, double gap, int max_nodes, int scenarios, int depth,
                       double regularisation, double target, std::size_t memory, std::uint64_t seed,
                       bool cpu_time) {
             DespotOptions options;
             options.deadline = deadline;
             options.gap = gap;
             options.max_nodes = max_nodes;
             options.scenarios = scenarios;
             options.depth = depth;
             options.regularisation = regularisation;
             options.target = target;
             options.memory = memory;
             options.seed = seed;
             options.cpu_time = cpu_time;
             return options;
           }),
           "deadline"_a = standard.deadline, "gap"_a = standard.gap,
           "max_nodes"_a = standard.max_nodes, "scenarios"_a = standard.scenarios,
           "depth"_a = standard.depth, "regularisation"_a = standard.regularisation,
           "target"_a = standard.target, "memory"_a = standard.memory, "seed"_a = standard.seed,
           "cpu_time"_a = standard.cpu_time,
           "deadline: s a decision may take, of CPU time when cpu_time; gap: difference of the\n"
           "bounds that is good enough; max_nodes: histories to open; scenarios: K; depth: steps\n"
           "looked ahead; regularisation: price of a policy node; target: share of the root's gap\n"
           "at which a branch is done; memory: bytes of the tree, taken once; seed: of all draws.")
      .def_readwrite("deadline", &DespotOptions::deadline)
      .def_readwrite("gap", &DespotOptions::gap)
      .def_readwrite("max_nodes", &DespotOptions::max_nodes)
      .def_readwrite("scenarios", &DespotOptions::scenarios)
      .def_readwrite("depth", &DespotOptions::depth)
      .def_readwrite("regularisation", &DespotOptions::regularisation)
      .def_readwrite("target", &DespotOptions::target)
      .def_readwrite("memory", &DespotOptions::memory)
      .def_readwrite("seed", &DespotOptions::seed)
      .def_readwrite("cpu_time", &DespotOptions::cpu_time);
}

void bindPomcpOptions(py::module_& module) {
  const PomcpOptions standard;
  py::enum_<Rollout>(module, "Rollout")
      .value("RANDOM", Rollout::RANDOM, "legal actions, uniformly")
      .value("DEFAULT_ACTION", Rollout::DEFAULT_ACTION, "the model's default_action, if any");
  py::class_<PomcpOptions>(module, "PomcpOptions")
      .def(py::init([](double deadline, int max_simulations, double exploration, int max_depth,
                       Rollout rollout, std::size_t memory, std::uint64_t seed, bool cpu_time) {
             return PomcpOptions{deadline, max_simulations, exploration, max_depth,
                                 rollout,  memory,          seed,        cpu_time};
           }),
           "deadline"_a = standard.deadline, "max_simulations"_a = standard.max_simulations,
           "exploration"_a = standard.exploration, "max_depth"_a = standard.max_depth,
           "rollout"_a = standard.rollout, "memory"_a = standard.memory, "seed"_a = standard.seed,
           "cpu_time"_a = standard.cpu_time,
           "deadline: s a decision may take, of CPU time when cpu_time; exploration: c of UCB1 in\n"
           "rewards, < 0 for the width of the reward range; max_depth: steps of a simulation;\n"
           "memory: bytes of the tree, taken once; seed: of all draws.")
      .def_readwrite("deadline", &PomcpOptions::deadline)
      .def_readwrite("max_simulations", &PomcpOptions::max_simulations)
      .def_readwrite("exploration", &PomcpOptions::exploration)
      .def_readwrite("max_depth", &PomcpOptions::max_depth)
      .def_readwrite("rollout", &PomcpOptions::rollout)
      .def_readwrite("memory", &PomcpOptions::memory)
      .def_readwrite("seed", &PomcpOptions::seed)
      .def_readwrite("cpu_time", &PomcpOptions::cpu_time);
}

void bindBelief(py::module_& module) {
  py::class_<AnyBelief>(module, "GenerativeBelief")
      .def("reset", &AnyBelief::reset, "seed"_a, "Back to the initial belief.")
      .def("update", &AnyBelief::update, "action"_a, "observation"_a,
           "Conditions on what was done and seen; an impossible observation gives RECOVERED.")
      .def("sample", &AnyBelief::sample, "count"_a, "seed"_a, "A list of `count` states.")
      .def_property_readonly("recoveries", &AnyBelief::recoveries,
                             "updates since the last reset that needed the recovery");
}

template <class Options>
std::vector<Episode> evaluate(AnyModel& model, const Options& options, int episodes,
                              std::uint64_t seed, int max_steps) {
  if (episodes < 1 || max_steps < 1) {
    throw ModelError("episodes and max_steps are " + std::to_string(episodes) + " and " +
                     std::to_string(max_steps) + ", expected >= 1");
  }
  EpisodeOptions limits;
  limits.max_steps = max_steps;
  return model.evaluate(options, episodes, seed, limits);
}

void bindModel(py::module_& module) {
  py::class_<AnyModel, std::shared_ptr<AnyModel>>(
      module, "CompiledModel",
      "A generative model in C++. States are opaque but can be compared and hashed;\n"
      "observations are integers.")
      .def_property_readonly("n_actions", &AnyModel::numActions)
      .def_property_readonly("discount", &AnyModel::discount)
      .def_property_readonly("action_names", &AnyModel::actionNames)
      .def_property_readonly("reward_range",
                             [](const AnyModel& model) {
                               const RewardRange range = model.rewardRange();
                               return py::make_tuple(range.low, range.high);
                             })
      .def("initial_state", &AnyModel::initialState, "seed"_a, "A draw from the initial belief.")
      .def(
          "step",
          [](AnyModel& model, py::handle state, int action, double u) {
            AnyStep step = model.step(state, action, u);
            return py::make_tuple(step.state, step.reward, step.observation, step.terminal);
          },
          "state"_a, "action"_a, "u"_a,
          "(state, reward, observation, terminal), a function of state, action and u in [0, 1).")
      .def("observation_probability", &AnyModel::observationProbability, "next_state"_a, "action"_a,
           "observation"_a)
      .def("_make_belief", &AnyModel::makeBelief, "seed"_a)
      .def(
          "_make_particles",
          [](AnyModel& model, std::uint64_t seed, int particles, int recovery_tries) {
            return model.makeParticles(seed, {particles, recovery_tries});
          },
          "seed"_a, "particles"_a, "recovery_tries"_a)
      .def("_make_planner", py::overload_cast<const DespotOptions&>(&AnyModel::makePlanner),
           "options"_a)
      .def("_make_planner", py::overload_cast<const PomcpOptions&>(&AnyModel::makePlanner),
           "options"_a)
      .def("_evaluate", &evaluate<DespotOptions>, "options"_a, "episodes"_a, "seed"_a,
           "max_steps"_a)
      .def("_evaluate", &evaluate<PomcpOptions>, "options"_a, "episodes"_a, "seed"_a,
           "max_steps"_a);
  py::class_<AnyPlanner>(module, "GenerativePlanner")
      .def("decide", &AnyPlanner::decide, "belief"_a)
      .def("advance", &AnyPlanner::advance, "action"_a, "observation"_a)
      .def("reset", &AnyPlanner::reset, "seed"_a)
      .def_property_readonly("memory", &AnyPlanner::memory);
}

void bindEpisode(py::module_& module) {
  py::class_<Episode>(module, "Episode")
      .def_readonly("discounted", &Episode::discounted, "sum of gamma^t r_t")
      .def_readonly("undiscounted", &Episode::undiscounted, "sum of r_t")
      .def_readonly("steps", &Episode::steps)
      .def_readonly("terminal", &Episode::terminal, "false: max_steps was reached")
      .def_readonly("trials", &Episode::trials)
      .def_readonly("nodes", &Episode::nodes)
      .def_readonly("recoveries", &Episode::recoveries, "of the belief")
      .def_property_readonly(
          "planning_time",
          [](const Episode& episode) {
            return py::array_t<double>(static_cast<py::ssize_t>(episode.planning_time.size()),
                                       episode.planning_time.data());
          },
          "(steps,): s of thread CPU time")
      .def_readonly("belief_time", &Episode::belief_time, "s of thread CPU time, in all");
}

}  // namespace

void bindGenerative(py::module_& module) {
  bindRandom(module);
  bindDespotOptions(module);
  bindPomcpOptions(module);
  bindBelief(module);
  bindModel(module);
  bindEpisode(module);
  bindModels(module);
}

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/eigen.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>

#include <memory>
#include <optional>

#include "bindings.hpp"
#include "fabric_planner/evaluate.hpp"

namespace py = pybind11;
using py::literals::operator""_a;

namespace fabric::planner {
namespace {

using Model = std::shared_ptr<Pomdp>;

/// Holds the interpreter's lock again while the policy's functions run.
BeliefPolicy policyOf(const py::function& decide) {
  return {[decide](const Eigen::VectorXd& belief) {
            const py::gil_scoped_acquire acquire;
            return decide(belief).cast<int>();
          },
          nullptr, nullptr};
}

void checkPlanner(const Pomdp& model, const OnlinePlanner& planner) {
  if (planner.model().numStates() == model.numStates() &&
      planner.model().numActions() == model.numActions() &&
      planner.model().numObservations() == model.numObservations()) {
    return;
  }
  throw ModelError(model.name() + ": the planner is for another model, " + planner.model().name());
}

void checkVectors(const Pomdp& model, const AlphaVectors& vectors) {
  if (vectors.vectors.cols() != model.numStates()) {
    throw ModelError(model.name() + ": vectors of " + std::to_string(vectors.vectors.cols()) +
                     " entries for " + std::to_string(model.numStates()) + " states");
  }
  for (const int action : vectors.actions) model.checkAction(action);
}

/// An OnlinePlanner, AlphaVectors, or a function from belief to action.
BeliefPolicy toPolicy(const Pomdp& model, const py::object& policy) {
  if (py::isinstance<OnlinePlanner>(policy)) {
    auto& planner = policy.cast<OnlinePlanner&>();
    checkPlanner(model, planner);
    return policyOf(planner);
  }
  if (py::isinstance<AlphaVectors>(policy)) {
    auto vectors = policy.cast<AlphaVectors>();
    checkVectors(model, vectors);
    return policyOf(model, std::move(vectors));
  }
  if (py::isinstance<py::function>(policy)) return policyOf(policy.cast<py::function>());
  throw py::type_error(
      "a policy is an OnlinePlanner, AlphaVectors or a function from belief to "
      "action");
}

Evaluation evaluatePolicy(const Model& model, const py::object& policy, int episodes,
                          std::uint64_t seed, int steps,
                          const std::optional<AlphaVectors>& reference) {
  const BeliefPolicy ours = toPolicy(*model, policy);
  const py::gil_scoped_release release;
  const AlphaVectors V = reference ? *reference : pointBasedBound(*model);
  return evaluate(*model, ours, V, {episodes, steps, seed});
}

std::vector<SimulatedStep> simulatePolicy(const Model& model, const py::object& policy, int steps,
                                          std::uint64_t seed) {
  const BeliefPolicy ours = toPolicy(*model, policy);
  const py::gil_scoped_release release;
  return simulate(*model, ours, steps, seed);
}

std::string shown(const Evaluation& e) {
  return "<Evaluation: return " + std::to_string(e.mean_return) + " +- " +
         std::to_string(e.standard_error) + ", cv " + std::to_string(e.cv) + " +- " +
         std::to_string(e.cv_standard_error) + ">";
}

void bindResults(py::module_& module) {
  py::class_<SimulatedStep>(module, "SimulatedStep", "One step of a simulated episode.")
      .def_readonly("state", &SimulatedStep::state, "before the action")
      .def_readonly("action", &SimulatedStep::action)
      .def_readonly("observation", &SimulatedStep::observation)
      .def_readonly("reward", &SimulatedStep::reward, "R(s, a)")
      .def_property_readonly(
          "belief", [](const SimulatedStep& s) { return Eigen::VectorXd(s.belief); },
          "(S,), before the action");
  py::class_<Evaluation>(module, "Evaluation", "What a policy is worth from the initial belief.")
      .def_readonly("mean_return", &Evaluation::mean_return, "discounted")
      .def_readonly("standard_error", &Evaluation::standard_error, "of mean_return")
      .def_readonly("cv", &Evaluation::cv, "the same value with less noise; see evaluate")
      .def_readonly("cv_standard_error", &Evaluation::cv_standard_error)
      .def_readonly("decisions", &Evaluation::decisions)
      .def_readonly("decision_time", &Evaluation::decision_time,
                    "s of the thread's own time a decision, mean")
      .def_readonly("median_decision_time", &Evaluation::median_decision_time, "s")
      .def("__repr__", &shown);
}

}  // namespace

void bindEvaluate(py::module_& module) {
  bindResults(module);
  module.def(
      "evaluate", &evaluatePolicy, "model"_a, "policy"_a, "episodes"_a = 200, "seed"_a = 1,
      "steps"_a = 0, "reference"_a = py::none(),
      "Simulates a policy (an OnlinePlanner, AlphaVectors, or a function from belief to action)\n"
      "from the initial belief. Evaluations with one seed share their luck. steps: of an episode,\n"
      "0 until what is left counts less than 1e-6.\n\n"
      "cv is V(b0) less the mean discounted sum of V(b) - Q(b, a) along the episodes, with V the\n"
      "largest of the vectors of `reference` (by default the point-based lower bound) and Q its\n"
      "exact backup: the value of the policy, too, and far less noisy than its return.\n"
      "Raises ModelError.");
  module.def(
      "simulate", &simulatePolicy, "model"_a, "policy"_a, "steps"_a = 100, "seed"_a = 1,
      "One episode as a list of SimulatedStep, until a terminal state. policy: as evaluate.");
}

}  // namespace fabric::planner

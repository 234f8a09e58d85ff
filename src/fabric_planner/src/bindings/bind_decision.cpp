// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <unordered_map>

#include "bindings.hpp"
#include "fabric_planner/decision_agent.hpp"

namespace py = pybind11;
using py::literals::operator""_a;

namespace fabric::planner {
namespace {

constexpr int TRIGGER_START = 0;  // fabric_msgs/Observation

/// A name as Python looks it up, made once; name: a literal.
PyObject* interned(const char* name) {
  static std::unordered_map<const char*, PyObject*> names;  // guarded by the interpreter's lock
  PyObject*& found = names[name];
  if (found == nullptr) found = PyUnicode_InternFromString(name);
  return found;
}

template <class T>
T get(const py::object& object, const char* name) {
  PyObject* value = PyObject_GetAttr(object.ptr(), interned(name));
  if (value == nullptr) throw py::error_already_set();
  return py::reinterpret_steal<py::object>(value).cast<T>();
}

template <class T>
void set(const py::object& object, const char* name, const T& value) {
  if (PyObject_SetAttr(object.ptr(), interned(name), py::cast(value).ptr()) != 0) {
    throw py::error_already_set();
  }
}

Features toFeatures(const py::object& o) {
  Features f;
  f.task_success = get<bool>(o, "task_success");
  f.task_failure = get<bool>(o, "task_failure");
  f.detected = get<bool>(o, "detected");
  f.looking_around = get<bool>(o, "looking_around");
  f.grasp_attempt = get<bool>(o, "grasp_attempt");
  f.warning = get<bool>(o, "warning");
  f.idle = get<bool>(o, "idle");
  f.subtask_success = get<bool>(o, "subtask_success");
  f.subtask_failure = get<bool>(o, "subtask_failure");
  f.robot_success = get<bool>(o, "robot_success");
  f.robot_failure = get<bool>(o, "robot_failure");
  f.subtask_elapsed = get<double>(o, "subtask_elapsed");
  f.waiting_time = get<double>(o, "waiting_time");
  f.failed_attempts = get<double>(o, "failed_attempts");
  return f;
}

AgentObservation toObservation(const py::object& o) {
  return {toFeatures(o), get<std::uint32_t>(o, "sequence"), get<std::uint32_t>(o, "task_id"),
          get<int>(o, "trigger") == TRIGGER_START};
}

py::object fill(const AgentDecision& d, py::object message) {
  set(message, "sequence", d.observation_sequence);
  set(message, "observation_sequence", d.observation_sequence);
  set(message, "task_id", d.task_id);
  set(message, "model_hash", d.model_hash);
  set(message, "action", static_cast<int>(d.action));
  set(message, "action_index", d.action_index);
  set(message, "observation_index", d.observation_index);
  set(message, "belief", std::vector<double>(d.belief.begin(), d.belief.end()));
  set(message, "value", d.plan.value);
  set(message, "lower_bound", d.plan.lower_bound);
  set(message, "upper_bound", d.plan.upper_bound);
  set(message, "runner_up", d.plan.runner_up);
  set(message, "runner_up_gap", d.plan.runner_up_gap);
  set(message, "nodes", d.plan.nodes);
  set(message, "planning_time", d.plan.planning_time);
  set(message, "deadline_missed", d.plan.deadline_missed);
  set(message, "fallback_used", d.plan.fallback_used);
  set(message, "belief_recovered", d.belief_recovered);
  return message;
}

/// A read-only property out of the plan.
template <class T>
auto planned(T Decision::*field) {
  return [field](const AgentDecision& d) { return d.plan.*field; };
}

void bindAgentDecision(py::module_& module) {
  py::class_<AgentDecision>(module, "AgentDecision", "The fields of fabric_msgs/Decision.")
      .def_readonly("sequence", &AgentDecision::observation_sequence)
      .def_readonly("observation_sequence", &AgentDecision::observation_sequence)
      .def_readonly("task_id", &AgentDecision::task_id)
      .def_readonly("model_hash", &AgentDecision::model_hash)
      .def_property_readonly(
          "action", [](const AgentDecision& d) { return static_cast<int>(d.action); },
          "Decision.IDLE..CANCEL")
      .def_property_readonly(
          "action_name", [](const AgentDecision& d) { return actionName(d.action); },
          "idle, planning, point, grasp or cancel")
      .def_readonly("action_index", &AgentDecision::action_index, "as the model numbers it")
      .def_readonly("observation_index", &AgentDecision::observation_index, "the model's symbol")
      .def_readonly("belief", &AgentDecision::belief, "(S,), sums to 1")
      .def_property_readonly("value", planned(&Decision::value))
      .def_property_readonly("lower_bound", planned(&Decision::lower_bound))
      .def_property_readonly("upper_bound", planned(&Decision::upper_bound))
      .def_property_readonly("runner_up", planned(&Decision::runner_up))
      .def_property_readonly("runner_up_gap", planned(&Decision::runner_up_gap))
      .def_property_readonly("nodes", planned(&Decision::nodes))
      .def_property_readonly("planning_time", planned(&Decision::planning_time), "s")
      .def_property_readonly("deadline_missed", planned(&Decision::deadline_missed))
      .def_property_readonly("fallback_used", planned(&Decision::fallback_used))
      .def_property_readonly("ended_by", planned(&Decision::ended_by))
      .def_readonly("belief_recovered", &AgentDecision::belief_recovered)
      .def_readonly("trouble", &AgentDecision::trouble, "why the fallback was taken, else empty")
      .def("fill", &fill, "message"_a,
           "Set the fields of a fabric_msgs/Decision but its header; returns the message.");
}

std::unique_ptr<DecisionAgent> makeAgent(const std::string& path, PlannerOptions limits,
                                         const std::string& map, const std::string& solver,
                                         const std::optional<AlphaVectors>& policy,
                                         const std::string& fallback, std::uint64_t seed) {
  const py::gil_scoped_release release;
  AgentOptions options(limits);
  options.solver = solverFromName(solver);
  options.policy = policy;
  if (!fallback.empty()) options.fallback = actionFromName(fallback);
  options.seed = seed;
  return std::make_unique<DecisionAgent>(path, options, map);
}

void bindMap(py::module_& module) {
  py::class_<ObservationMap>(module, "ObservationMap",
                             "From the booleans of an observation to a model's symbols.")
      .def_static("load", &ObservationMap::load, "path"_a, "observations"_a,
                  "Raises ModelError naming file, rule and entry.")
      .def_static("parse", &ObservationMap::parse, "text"_a, "name"_a, "observations"_a,
                  "As load, from YAML text; `name` begins every error message.")
      .def(
          "symbol",
          [](const ObservationMap& map, const py::object& features, std::optional<int> previous) {
            return map.symbol(toFeatures(features), previous);
          },
          "features"_a, "previous"_a = std::nullopt,
          "Index of the symbol; features: anything with the fields of fabric_msgs/Observation;\n"
          "previous: index of the symbol before, None at the start.")
      .def_property_readonly("observations", &ObservationMap::observations);
}

}  // namespace

void bindDecision(py::module_& module) {
  bindMap(module);
  bindAgentDecision(module);
  py::class_<DecisionAgent>(module, "DecisionAgent",
                            "From observations to decisions: observation map, belief, search.")
      .def(
          py::init(&makeAgent), "model_path"_a, "options"_a = PlannerOptions{}, "map_path"_a = "",
          "solver"_a = "search", "policy"_a = py::none(), "fallback"_a = "", "seed"_a = 1,
          "map_path: empty for <model>.obs.yaml beside the model; solver: search, offline, despot\n"
          "or pomcp; policy: AlphaVectors that offline runs and search counts on as a lower "
          "bound,\n"
          "for this model only; fallback: name of the action taken when no decision can be found,\n"
          "empty for an exception; seed: of the draws of despot and pomcp. Raises ModelError.")
      .def("reset", &DecisionAgent::reset, "A new task.")
      .def("set_model", &DecisionAgent::setModel, "path"_a, "keep_belief"_a, "map_path"_a = "",
           py::call_guard<py::gil_scoped_release>(),
           "Run another model; keep_belief carries the belief over by state name. Raises\n"
           "ModelError and keeps the present model when the new one is refused.")
      .def(
          "decide",
          [](DecisionAgent& agent, const py::object& observation) {
            const AgentObservation converted = toObservation(observation);
            py::gil_scoped_release release;
            return agent.decide(converted);
          },
          "observation"_a, "observation: anything with the fields of fabric_msgs/Observation.")
      .def(
          "choose",
          [](DecisionAgent& agent, const py::object& observation) {
            const AgentObservation converted = toObservation(observation);
            py::gil_scoped_release release;
            return static_cast<int>(agent.decide(converted).action);
          },
          "observation"_a, "As decide; returns the action alone, Decision.IDLE..CANCEL.")
      .def_property_readonly(
          "model",
          [](const DecisionAgent& a) { return std::const_pointer_cast<Pomdp>(a.model().pomdp); })
      .def_property_readonly("model_name", [](const DecisionAgent& a) { return a.model().name; })
      .def_property_readonly("model_path", [](const DecisionAgent& a) { return a.model().path; })
      .def_property_readonly(
          "model_hash", [](const DecisionAgent& a) { return a.model().hash; },
          "SHA-256 of the model file followed by its observation map")
      .def_property_readonly("belief", &DecisionAgent::belief, "(S,), sums to 1");
}

}  // namespace fabric::planner

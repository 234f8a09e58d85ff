// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <memory>
#include <optional>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fabric_planner/online_planner.hpp"

namespace py = pybind11;
using py::literals::operator""_a;

namespace fabric::planner {
namespace {

void bindOptions(py::module_& module) {
  py::enum_<Preparation>(module, "Preparation", "What is computed before the first decision.")
      .value("QUICK", Preparation::QUICK, "some bounds, soon ready")
      .value("THOROUGH", Preparation::THOROUGH, "good bounds");
  py::class_<PlannerOptions>(module, "PlannerOptions")
      .def(py::init([](double deadline, double gap, int max_nodes, Preparation preparation) {
             return PlannerOptions{deadline, gap, max_nodes, preparation};
           }),
           "deadline"_a = PlannerOptions{}.deadline, "gap"_a = PlannerOptions{}.gap,
           "max_nodes"_a = PlannerOptions{}.max_nodes,
           "preparation"_a = PlannerOptions{}.preparation,
           "deadline: s a decision may take; gap: upper minus lower bound that is good enough;\n"
           "max_nodes: expanded beliefs the tree may hold. All >= 0.")
      .def_readwrite("deadline", &PlannerOptions::deadline)
      .def_readwrite("gap", &PlannerOptions::gap)
      .def_readwrite("max_nodes", &PlannerOptions::max_nodes)
      .def_readwrite("preparation", &PlannerOptions::preparation);
}

void bindDecisionResult(py::module_& module) {
  py::enum_<EndedBy>(module, "EndedBy")
      .value("GAP", EndedBy::GAP, "the bounds met")
      .value("NODES", EndedBy::NODES, "max_nodes beliefs were expanded")
      .value("DEADLINE", EndedBy::DEADLINE, "time was up");
  py::class_<Decision>(module, "Decision", "What the planner chose, and how sure it is.")
      .def_readonly("action", &Decision::action, "index of the action")
      .def_readonly("value", &Decision::value, "of the action, at its lower bound")
      .def_readonly("lower_bound", &Decision::lower_bound, "of the optimal value")
      .def_readonly("upper_bound", &Decision::upper_bound, "of the optimal value")
      .def_readonly("runner_up", &Decision::runner_up, "second best action, -1 when none")
      .def_readonly("runner_up_gap", &Decision::runner_up_gap, "value lost by taking it")
      .def_readonly("nodes", &Decision::nodes, "expanded beliefs of the tree")
      .def_readonly("kept_nodes", &Decision::kept_nodes,
                    "those of them that were kept from the step before")
      .def_readonly("trials", &Decision::trials, "paths followed from the root down")
      .def_readonly("planning_time", &Decision::planning_time, "s")
      .def_readonly("deadline_missed", &Decision::deadline_missed)
      .def_readonly("fallback_used", &Decision::fallback_used,
                    "nothing was searched; the offline policy answered")
      .def_readonly("ended_by", &Decision::ended_by);
}

/// One dict an entry, in the order of OnlinePlanner::tree.
py::list treeOf(const OnlinePlanner& planner, int max_depth, double min_probability) {
  std::vector<TreeEntry> entries;
  {
    py::gil_scoped_release release;
    entries = planner.tree(max_depth, min_probability);
  }
  py::list list;
  for (const TreeEntry& entry : entries) {
    list.append(py::dict(
        "kind"_a = entry.isBelief() ? "belief" : "action", "parent"_a = entry.parent,
        "depth"_a = entry.depth, "action"_a = entry.action, "observation"_a = entry.observation,
        "probability"_a = entry.probability, "reach"_a = entry.reach, "lower"_a = entry.lower,
        "upper"_a = entry.upper, "expanded"_a = entry.expanded));
  }
  return list;
}

std::unique_ptr<OnlinePlanner> makePlanner(std::shared_ptr<Pomdp> model, PlannerOptions options,
                                           const std::optional<AlphaVectors>& lower,
                                           const std::optional<PointUpperBound>& upper) {
  const py::gil_scoped_release release;
  if (!lower && !upper) return std::make_unique<OnlinePlanner>(std::move(model), options);
  return std::make_unique<OnlinePlanner>(model, options,
                                         lower ? *lower : preparedLowerBound(*model, options),
                                         upper ? *upper : preparedUpperBound(*model, options));
}

}  // namespace

void bindPlanner(py::module_& module) {
  bindOptions(module);
  bindDecisionResult(module);
  py::class_<OnlinePlanner>(module, "OnlinePlanner",
                            "Anytime search over exact beliefs between two bounds. The same\n"
                            "belief gives the same decision unless it ended by DEADLINE.")
      .def(py::init(&makePlanner), "model"_a, "options"_a = PlannerOptions{},
           "lower"_a = py::none(), "upper"_a = py::none(),
           "lower: AlphaVectors, upper: UpperBound, for example of a Solution; what is not given "
           "is\n"
           "computed as the options say.")
      .def("decide", &OnlinePlanner::decide, "belief"_a, py::call_guard<py::gil_scoped_release>(),
           "belief: (S,), sums to 1; raises ModelError for anything else. Goes on with the tree\n"
           "when the belief is that of its root.")
      .def("advance", &OnlinePlanner::advance, "action"_a, "observation"_a,
           py::call_guard<py::gil_scoped_release>(),
           "What was done at the last belief and what was observed then: the next decision goes\n"
           "on with what was searched below them. Raises IndexError.")
      .def("reset", &OnlinePlanner::reset, py::call_guard<py::gil_scoped_release>(),
           "Forget the tree.")
      .def("tree", &treeOf, "max_depth"_a = 2, "min_probability"_a = 0.0,
           "The search tree, level by level, as a list of dicts with the keys kind (belief or\n"
           "action), parent (index in the list, -1 at the root), depth (steps from the root),\n"
           "action, observation (-1 where there is none), probability (of the observation), reach\n"
           "(product of the probabilities from the root), lower, upper and expanded (beliefs\n"
           "expanded from there down). Beliefs with a reach below min_probability are left out.")
      .def_property_readonly(
          "lower_bound", [](const OnlinePlanner& p) { return RowMajor(p.lowerBound().vectors); },
          "(K, S): the offline lower bound")
      .def_property_readonly(
          "upper_bound",
          [](const OnlinePlanner& p) { return RowMajor(p.upperBound().base().vectors); },
          "(A, S): the vectors of the offline upper bound; its points come on top");
}

}  // namespace fabric::planner

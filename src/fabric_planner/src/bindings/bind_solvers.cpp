// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <memory>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fabric_planner/bounds.hpp"
#include "fabric_planner/mdp.hpp"
#include "fabric_planner/solve.hpp"

namespace py = pybind11;
using py::literals::operator""_a;

namespace fabric::planner {
namespace {

std::vector<std::string> numbered(Eigen::Index count) {
  std::vector<std::string> names;
  for (Eigen::Index i = 0; i < count; ++i) names.push_back(std::to_string(i));
  return names;
}

/// An MDP as a POMDP that shows nothing; its tables go through the same checks.
Pomdp asPomdp(const Array& T, const Eigen::MatrixXd& R, double discount) {
  PomdpTables tables;
  tables.name = "arrays";
  tables.T = toMatrices(T, "T");
  tables.actions = numbered(static_cast<Eigen::Index>(tables.T.size()));
  tables.states = numbered(T.shape(1));
  tables.observations = {"nothing"};
  tables.O.assign(tables.T.size(), Eigen::MatrixXd::Ones(T.shape(1), 1));
  tables.R = R;
  tables.discount = discount;
  tables.initial_belief =
      Eigen::VectorXd::Constant(T.shape(1), 1.0 / static_cast<double>(T.shape(1)));
  return Pomdp(tables);
}

template <AlphaVectors (*solve)(const Pomdp&)>
RowMajor vectorsOf(const std::shared_ptr<Pomdp>& model) {
  py::gil_scoped_release release;
  return solve(*model).vectors;
}

AlphaVectors informed(const Pomdp& model) { return fastInformedBound(model); }
AlphaVectors pointBased(const Pomdp& model) { return pointBasedBound(model); }

py::array_t<int> policyOf(const MdpSolution& solution) {
  return py::array_t<int>(static_cast<py::ssize_t>(solution.policy.size()), solution.policy.data());
}

void checkLength(const Eigen::VectorXd& belief, Eigen::Index states) {
  if (belief.size() == states) return;
  throw ModelError("belief has " + std::to_string(belief.size()) + " entries for " +
                   std::to_string(states) + " states");
}

template <double (PointUpperBound::*value)(const Eigen::Ref<const Eigen::VectorXd>&) const>
double valueAt(const PointUpperBound& bound, const Eigen::VectorXd& belief) {
  checkLength(belief, bound.corners().size());
  return (bound.*value)(belief);
}

void bindUpperBound(py::module_& module) {
  py::class_<PointUpperBound>(module, "UpperBound",
                              "Interpolates between beliefs whose value is known to be at most v.")
      .def("value", &valueAt<&PointUpperBound::value>, "belief"_a,
           "belief: (S,), need not sum to 1. The quick bound: one point, the rest by the base.")
      .def("exact_value", &valueAt<&PointUpperBound::exactValue>, "belief"_a,
           "belief: (S,), need not sum to 1. By linear programming over all points.")
      .def_property_readonly(
          "base", [](const PointUpperBound& b) { return RowMajor(b.base().vectors); },
          "(A, S): the fast informed bound")
      .def_property_readonly(
          "corners", [](const PointUpperBound& b) { return Eigen::VectorXd(b.corners()); },
          "(S,): what certain states are worth at most")
      .def_property_readonly(
          "points", [](const PointUpperBound& b) { return RowMajor(b.points().transpose()); },
          "(N, S), rows sum to 1")
      .def_property_readonly("values", &PointUpperBound::values,
                             "(N,): what the points are worth at most");
}

RowMajor historyOf(const Solution& solution) {
  RowMajor rows(static_cast<Eigen::Index>(solution.history.size()), 4);
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const SolveProgress& entry = solution.history[static_cast<size_t>(i)];
    rows.row(i) << entry.time, entry.work, entry.lower, entry.upper;
  }
  return rows;
}

void bindSolve(py::module_& module) {
  py::class_<Solution>(module, "Solution", "A policy and how far it may be from the best one.")
      .def_readonly("lower", &Solution::lower,
                    "AlphaVectors: each is the value of a policy that begins with its action")
      .def_readonly("upper", &Solution::upper, "UpperBound")
      .def_property_readonly("lower_value", &Solution::lowerValue, "at the initial belief")
      .def_property_readonly("upper_value", &Solution::upperValue, "at the initial belief")
      .def_property_readonly("gap", &Solution::gap, "upper_value - lower_value")
      .def_property_readonly("history", &historyOf,
                             "(n, 4): CPU time in s, multiplications, lower and upper bound at the "
                             "initial belief");
  const SolveOptions defaults;
  module.def(
      "solve",
      [](const std::shared_ptr<Pomdp>& model, double time, double gap, double work, int beliefs,
         int points, std::uint64_t seed, const py::object& progress) {
        SolveOptions options;
        options.time = time;
        options.gap = gap;
        options.work = work;
        options.beliefs = beliefs;
        options.points = points;
        options.seed = seed;
        if (!progress.is_none()) {
          options.progress = [&progress](const SolveProgress& now) {
            const py::gil_scoped_acquire acquire;
            progress(now.time, now.lower, now.upper);
          };
        }
        py::gil_scoped_release release;
        return solve(*model, options);
      },
      "model"_a, "time"_a = defaults.time, "gap"_a = defaults.gap, "work"_a = defaults.work,
      "beliefs"_a = defaults.beliefs, "points"_a = defaults.points, "seed"_a = defaults.seed,
      "progress"_a = py::none(),
      "Improves a lower and an upper bound until `time` (s of CPU time), `work` (multiplications)\n"
      "or the `gap` at the initial belief is reached. beliefs, points: at most, of the lower and\n"
      "the upper bound. Repeats exactly unless time ended it. progress, a function of\n"
      "(CPU time, lower, upper), is called whenever a bound may have moved. Raises ModelError.");
}

}  // namespace

void bindSolvers(py::module_& module) {
  bindUpperBound(module);
  bindSolve(module);
  py::class_<MdpSolution>(module, "MdpSolution", "Properties return copies.")
      .def_property_readonly(
          "value", [](const MdpSolution& s) { return Eigen::VectorXd(s.value); }, "(S,)")
      .def_property_readonly(
          "q", [](const MdpSolution& s) { return RowMajor(s.q); }, "(A, S)")
      .def_property_readonly("policy", &policyOf, "(S,) index of the best action");
  module.def(
      "value_iteration",
      [](const std::shared_ptr<Pomdp>& model, double tolerance) {
        py::gil_scoped_release release;
        return valueIteration(*model, tolerance);
      },
      "model"_a, "tolerance"_a = 1e-9,
      "Solves the MDP under the model; value is at most tolerance above the exact one.");
  module.def(
      "policy_iteration",
      [](const std::shared_ptr<Pomdp>& model) {
        py::gil_scoped_release release;
        return policyIteration(*model);
      },
      "model"_a, "Solves the MDP under the model exactly, up to rounding.");
  module.def(
      "solve_mdp",
      [](const std::shared_ptr<Pomdp>& model, double tolerance) {
        py::gil_scoped_release release;
        return solveMdp(*model, tolerance);
      },
      "model"_a, "tolerance"_a = 1e-9, "Solves the MDP under the model, its state being seen.");
  module.def(
      "solve_mdp_arrays",
      [](const Array& T, const Eigen::MatrixXd& R, double discount, double tolerance) {
        const Pomdp model = asPomdp(T, R, discount);
        py::gil_scoped_release release;
        return solveMdp(model, tolerance);
      },
      "T"_a, "R"_a, "discount"_a, "tolerance"_a = 1e-9,
      "T: (A, S, S'), R: (A, S). Raises ModelError as Pomdp does.");
  module.def("qmdp", &vectorsOf<&qmdp>, "model"_a, "(A, S): upper bound, state known next step.");
  module.def("fast_informed_bound", &vectorsOf<&informed>, "model"_a,
             "(A, S): upper bound, never above QMDP.");
  module.def("blind_bound", &vectorsOf<&blindBound>, "model"_a,
             "(A, S): lower bound, one action for ever.");
  module.def("point_based_bound", &vectorsOf<&pointBased>, "model"_a,
             "(K, S): lower bound, never below the blind one.");
}

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <memory>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fabric_planner/bounds.hpp"
#include "fabric_planner/mdp.hpp"

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

}  // namespace

void bindSolvers(py::module_& module) {
  py::class_<MdpSolution>(module, "MdpSolution", "Properties return copies.")
      .def_property_readonly(
          "value", [](const MdpSolution& s) { return Eigen::VectorXd(s.value); }, "(S,)")
      .def_property_readonly(
          "q", [](const MdpSolution& s) { return RowMajor(s.q); }, "(A, S)")
      .def_property_readonly("policy", &policyOf, "(S,) index of the best action");
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

// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <memory>

#include "bindings.hpp"
#include "fabric_planner/bounds.hpp"
#include "fabric_planner/lint.hpp"
#include "fabric_planner/model_file.hpp"
#include "fabric_planner/policy_file.hpp"
#include "fabric_planner/pomdp_file.hpp"
#include "fabric_planner/pomdpx.hpp"

namespace py = pybind11;
using py::literals::operator""_a;

namespace fabric::planner {
namespace {

std::shared_ptr<AlphaVectors> makeVectors(Eigen::MatrixXd vectors, std::vector<int> actions) {
  if (vectors.rows() == 0 || vectors.rows() != static_cast<Eigen::Index>(actions.size())) {
    throw ModelError("vectors has " + std::to_string(vectors.rows()) + " rows for " +
                     std::to_string(actions.size()) + " actions; both need one for each vector");
  }
  if (!vectors.allFinite()) throw ModelError("vectors: not every entry is a finite number");
  auto policy = std::make_shared<AlphaVectors>();
  policy->vectors = std::move(vectors);
  policy->actions = std::move(actions);
  return policy;
}

/// @throw ModelError when the belief has another length than the vectors.
const Eigen::VectorXd& fitting(const AlphaVectors& policy, const Eigen::VectorXd& belief) {
  if (belief.size() == policy.vectors.cols()) return belief;
  throw ModelError("belief has " + std::to_string(belief.size()) + " entries for vectors of " +
                   std::to_string(policy.vectors.cols()));
}

void bindVectors(py::module_& module) {
  py::class_<AlphaVectors, std::shared_ptr<AlphaVectors>>(
      module, "AlphaVectors",
      "A policy and the bound that goes with it: the value at a belief is the largest of linear\n"
      "functions of it, and the action is that of the largest.")
      .def(py::init(&makeVectors), "vectors"_a, "actions"_a,
           "vectors: (K, S), finite; actions: (K,) index of the action each vector begins with.")
      .def_property_readonly(
          "vectors", [](const AlphaVectors& p) -> const Eigen::MatrixXd& { return p.vectors; },
          "(K, S), a read-only view without a copy; it keeps the policy alive")
      .def_readonly("actions", &AlphaVectors::actions, "(K,) indices, a copy")
      .def("__len__", [](const AlphaVectors& p) { return p.actions.size(); })
      .def(
          "value",
          [](const AlphaVectors& p, const Eigen::VectorXd& b) { return p.value(fitting(p, b)); },
          "belief"_a, "belief: (S,); it need not sum to 1, the value scales with it.")
      .def(
          "action",
          [](const AlphaVectors& p, const Eigen::VectorXd& b) {
            return p.actions[static_cast<size_t>(p.best(fitting(p, b)))];
          },
          "belief"_a, "belief: (S,). Index of the action of the largest vector.")
      .def("__repr__", [](const AlphaVectors& p) {
        return "<AlphaVectors: " + std::to_string(p.vectors.rows()) + " vectors over " +
               std::to_string(p.vectors.cols()) + " states>";
      });
}

using Path = std::filesystem::path;
using Loader = Pomdp (*)(const std::string&, bool);

template <Loader load>
std::shared_ptr<Pomdp> loaded(const Path& path, bool normalise) {
  py::gil_scoped_release release;
  return std::make_shared<Pomdp>(load(path.string(), normalise));
}

void bindModelFiles(py::module_& module) {
  module.def("load", &loaded<&loadModel>, "path"_a, "normalise"_a = false,
             "Reads a model from a POMDPX or .pomdp file; what it holds decides, not its ending.\n"
             "normalise: rescale rows that do not sum to 1. Raises ModelError naming file, line,\n"
             "element, row and token.");
  module.def("load_pomdpx", &loaded<&loadPomdpx>, "path"_a, "normalise"_a = false,
             "Reads a POMDPX file. Raises ModelError naming file, line, element, row and token.");
  module.def("load_pomdp", &loaded<&loadPomdpFile>, "path"_a, "normalise"_a = false,
             "Reads a file of Cassandra's format. Raises ModelError as load does.");
  module.def(
      "save_pomdpx",
      [](const Pomdp& model, const Path& path) {
        py::gil_scoped_release release;
        savePomdpx(model, path.string());
      },
      "model"_a, "path"_a,
      "Writes a POMDPX file with all digits of every number. Raises ModelError where the format\n"
      "has no place for something, such as actions allowed in some states only.");
}

void bindPolicyFiles(py::module_& module) {
  module.def(
      "load_policy",
      [](const Path& path, const Pomdp& model) {
        py::gil_scoped_release release;
        return std::make_shared<AlphaVectors>(loadPolicy(path.string(), model));
      },
      "path"_a, "model"_a,
      "Reads the AlphaVectors of a .policy file of SARSOP. Raises ModelError when they do not fit\n"
      "the model.");
  module.def(
      "save_policy",
      [](const AlphaVectors& policy, const Pomdp& model, const Path& path) {
        py::gil_scoped_release release;
        savePolicy(policy, model, path.string());
      },
      "policy"_a, "model"_a, "path"_a,
      "Writes a .policy file as SARSOP's, with all digits of every number.");
}

void bindLint(py::module_& module) {
  py::class_<Finding>(module, "Finding", "Something in a model that is allowed but seldom meant.")
      .def_property_readonly(
          "kind", [](const Finding& f) { return nameOf(f.kind); },
          "'endless', 'reward_repeats', 'end_not_absorbing', 'odd_reward', 'unreachable_state',\n"
          "'indistinguishable_state', 'silent_action', 'unused_observation', 'duplicate_action'\n"
          "or 'never_best_action'")
      .def_property_readonly(
          "severity", [](const Finding& f) { return nameOf(f.severity); },
          "'info', 'warning' or 'error'")
      .def_readonly("places", &Finding::places, "names of the states, actions or symbols")
      .def_readonly("sentence", &Finding::sentence)
      .def("__repr__", [](const Finding& f) {
        return "<Finding " + nameOf(f.severity) + " " + nameOf(f.kind) + ": " + f.sentence + ">";
      });
  module.def(
      "lint",
      [](const Pomdp& model) {
        py::gil_scoped_release release;
        return lint(model);
      },
      "model"_a,
      "What is allowed but seldom meant in a model, the gravest first: list of Finding.");
}

}  // namespace

void bindFiles(py::module_& module) {
  bindVectors(module);
  bindModelFiles(module);
  bindPolicyFiles(module);
  bindLint(module);
}

}  // namespace fabric::planner

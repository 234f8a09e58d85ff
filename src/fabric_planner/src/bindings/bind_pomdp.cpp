// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include <memory>
#include <mutex>
#include <optional>

#include "arrays.hpp"
#include "bindings.hpp"
#include "fabric_planner/belief_filter.hpp"
#include "fabric_planner/pomdp.hpp"
#include "rewards.hpp"

namespace py = pybind11;
using py::literals::operator""_a;

namespace fabric::planner {
namespace {

using Names = std::vector<std::string>;
using Indices = py::array_t<int, py::array::c_style | py::array::forcecast>;

bool isListOfSparse(const py::object& given) {
  const bool is_list = py::isinstance<py::list>(given) || py::isinstance<py::tuple>(given);
  return is_list && py::len(given) > 0 && py::hasattr(given[py::int_(0)], "tocsr");
}

/// One sparse table an action, from an array (A, rows, columns) or a list of A SciPy matrices.
template <typename Table>
std::vector<Table> toTables(const py::object& given, const std::string& element) {
  std::vector<Table> tables;
  if (isListOfSparse(given)) {
    for (const auto& matrix : given) {
      const py::object rows = matrix.attr("tocsr")("copy"_a = true);
      rows.attr("check_format")(true);
      rows.attr("sum_duplicates")();
      tables.push_back(py::cast<Table>(rows));
    }
    return tables;
  }
  const auto array = Array::ensure(given);
  if (!array) throw ModelError(element + " is no array of numbers");
  for (const auto& dense : toMatrices(array, element)) {
    tables.emplace_back(dense.sparseView(0.0, 0.0));
  }
  return tables;
}

/// (A, S), as given or as the expectation over next states and observations.
Eigen::MatrixXd toRewards(const Array& R, const SparseTables& tables) {
  if (R.ndim() == 2) return Eigen::Map<const RowMajor>(R.data(), R.shape(0), R.shape(1));
  SparseTables without = tables;
  without.R = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(tables.actions.size()),
                                    static_cast<Eigen::Index>(tables.states.size()));
  const Pomdp checked(std::move(without));
  return RewardArray(R, checked).expected();
}

std::shared_ptr<Pomdp> makePomdp(Names states, Names actions, Names observations,
                                 const py::object& T, const py::object& O, const Array& R,
                                 double discount, const Eigen::VectorXd& initial_belief,
                                 std::string name, const std::optional<Flags>& allowed) {
  SparseTables tables;
  tables.name = std::move(name);
  tables.states = std::move(states);
  tables.actions = std::move(actions);
  tables.observations = std::move(observations);
  tables.T = toTables<SparseRows>(T, "T");
  tables.O = toTables<SparseColumns>(O, "O");
  tables.discount = discount;
  tables.initial_belief = initial_belief;
  if (allowed) tables.allowed = *allowed;
  tables.R = toRewards(R, tables);
  py::gil_scoped_release release;
  return std::make_shared<Pomdp>(std::move(tables));
}

template <typename Table>
Table sparse(const Pomdp& model, int action, const Table& (Pomdp::*table)(int) const) {
  model.checkAction(action);
  return (model.*table)(action);
}

template <typename Table>
Array written(const Pomdp& model, const Table& (Pomdp::*table)(int) const) {
  std::vector<Eigen::MatrixXd> all;
  for (int a = 0; a < model.numActions(); ++a) all.emplace_back((model.*table)(a).toDense());
  return toArray(all);
}

py::array_t<bool> terminal(const Pomdp& model) {
  py::array_t<bool> flags(model.numStates());
  for (int s = 0; s < model.numStates(); ++s) {
    flags.mutable_at(s) = model.terminal()[static_cast<size_t>(s)];
  }
  return flags;
}

void bindModel(py::module_& module) {
  py::class_<Pomdp, std::shared_ptr<Pomdp>>(
      module, "Pomdp",
      "A tabular POMDP, checked when made and immutable afterwards. reward and initial_belief\n"
      "are read-only views that keep the model alive; everything else is a copy.")
      .def(py::init(&makePomdp), "states"_a, "actions"_a, "observations"_a, "T"_a, "O"_a, "R"_a,
           "discount"_a, "initial_belief"_a, "name"_a = "model", "allowed"_a = py::none(),
           "T: (A, S, S') P(s'|s,a); O: (A, S', O) P(o|a,s'), each an array or a list of A SciPy\n"
           "sparse matrices; R: (A, S), (A, S, S') or (A, S, S', O) reward;\n"
           "discount in (0, 1]; initial_belief: (S,), sums to 1; allowed: (A, S) bool, which\n"
           "actions may be taken, None for all. Raises ModelError naming the element, row and "
           "value\n"
           "that is not acceptable.")
      .def_property_readonly("name", &Pomdp::name)
      .def_property_readonly("states", &Pomdp::states)
      .def_property_readonly("actions", &Pomdp::actions)
      .def_property_readonly("observations", &Pomdp::observations)
      .def_property_readonly("n_states", &Pomdp::numStates)
      .def_property_readonly("n_actions", &Pomdp::numActions)
      .def_property_readonly("n_observations", &Pomdp::numObservations)
      .def_property_readonly("discount", &Pomdp::discount)
      .def_property_readonly("initial_belief", &Pomdp::initialBelief, "(S,), a read-only view")
      .def_property_readonly(
          "transition", [](const Pomdp& m) { return written(m, &Pomdp::T); },
          "(A, S, S'): P(s' | s, a)")
      .def_property_readonly(
          "observation", [](const Pomdp& m) { return written(m, &Pomdp::O); },
          "(A, S', O): P(o | a, s')")
      .def(
          "transition_sparse",
          [](const Pomdp& m, int action) { return sparse(m, action, &Pomdp::T); }, "action"_a,
          "(S, S') scipy.sparse.csr_matrix of one action; raises IndexError for others.")
      .def(
          "observation_sparse",
          [](const Pomdp& m, int action) { return sparse(m, action, &Pomdp::O); }, "action"_a,
          "(S', O) scipy.sparse.csc_matrix of one action; raises IndexError for others.")
      .def_property_readonly("reward", &Pomdp::R,
                             "(A, S): expected immediate reward, a read-only view")
      .def_property_readonly(
          "allowed", [](const Pomdp& m) { return Flags(m.allowed()); },
          "(A, S) bool; (0, 0) when every action may be taken everywhere")
      .def_property_readonly("fully_observable", &Pomdp::fullyObservable)
      .def_property_readonly("terminal", &terminal,
                             "(S,) bool: absorbing under every action and without reward")
      .def("state_index", &Pomdp::stateIndex, "name"_a)
      .def("action_index", &Pomdp::actionIndex, "name"_a)
      .def("observation_index", &Pomdp::observationIndex, "name"_a)
      .def("__repr__", [](const Pomdp& m) {
        return "<Pomdp " + m.name() + ": " + std::to_string(m.numStates()) + " states, " +
               std::to_string(m.numActions()) + " actions, " + std::to_string(m.numObservations()) +
               " observations>";
      });
}

/// A filter that several Python threads may share.
struct SharedFilter {
  explicit SharedFilter(std::shared_ptr<Pomdp> model) : filter(std::move(model)) {}

  template <typename Call>
  auto locked(Call call) {
    const std::lock_guard<std::mutex> lock(one_at_a_time);
    return call(filter);
  }

  BeliefFilter filter;
  std::mutex one_at_a_time;  // whoever holds it never waits for the interpreter
};

void reset(SharedFilter& shared, const std::optional<Eigen::VectorXd>& belief) {
  shared.locked([&](BeliefFilter& filter) {
    if (belief) {
      filter.reset(*belief);
    } else {
      filter.reset();
    }
  });
}

/// Many updates in a row without the interpreter between them.
std::uint64_t updateMany(SharedFilter& shared, const Indices& actions,
                         const Indices& observations) {
  if (actions.ndim() != 1 || observations.ndim() != 1 || actions.size() != observations.size()) {
    throw ModelError("actions and observations must be two rows of the same length");
  }
  const int* action = actions.data();
  const int* observation = observations.data();
  const auto count = actions.size();
  py::gil_scoped_release release;
  return shared.locked([&](BeliefFilter& filter) {
    const auto before = filter.recoveries();
    for (py::ssize_t i = 0; i < count; ++i) filter.update(action[i], observation[i]);
    return filter.recoveries() - before;
  });
}

void bindFilter(py::module_& module) {
  py::enum_<UpdateStatus>(module, "UpdateStatus")
      .value("OK", UpdateStatus::OK, "Bayes' rule held")
      .value("RECOVERED", UpdateStatus::RECOVERED, "the observation was impossible");
  py::class_<SharedFilter>(module, "BeliefFilter",
                           "The exact belief, with a counted recovery from observations that the\n"
                           "model calls impossible: the states they can come from take over; if\n"
                           "there are none, the prediction stays. Threads may share a filter.")
      .def(py::init<std::shared_ptr<Pomdp>>(), "model"_a)
      .def("reset", &reset, "belief"_a = py::none(),
           "belief: (S,), sums to 1; the model's initial one by default.")
      .def(
          "update",
          [](SharedFilter& shared, int action, int observation) {
            return shared.locked([&](BeliefFilter& f) { return f.update(action, observation); });
          },
          "action"_a, "observation"_a, "Indices of the model; raises IndexError for others.")
      .def("update_many", &updateMany, "actions"_a, "observations"_a,
           "Updates with one pair after the other; returns how many were recoveries.")
      .def_property_readonly(
          "belief",
          [](SharedFilter& shared) {
            return shared.locked([](BeliefFilter& f) { return Eigen::VectorXd(f.belief()); });
          },
          "(S,), a copy")
      .def_property_readonly("recoveries", [](SharedFilter& shared) {
        return shared.locked([](BeliefFilter& f) { return f.recoveries(); });
      });
}

}  // namespace

void bindPomdp(py::module_& module) {
  py::register_exception<ModelError>(module, "ModelError", PyExc_ValueError);
  bindModel(module);
  bindFilter(module);
}

}  // namespace fabric::planner

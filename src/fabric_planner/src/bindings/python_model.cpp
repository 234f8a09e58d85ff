// SPDX-License-Identifier: BSD-3-Clause
#include "python_model.hpp"

#include <pybind11/stl.h>

#include <cmath>

#include "fabric_planner/pomdp.hpp"

namespace py = pybind11;

namespace fabric::planner {
namespace {

[[noreturn]] void refuse(const std::string& what) { throw ModelError("Python model: " + what); }

double finite(double value, const std::string& what) {
  if (!std::isfinite(value)) refuse(what + " is " + std::to_string(value));
  return value;
}

}  // namespace

std::uint32_t ObjectTable::number(py::handle object) {
  PyObject* found = PyDict_GetItemWithError(numbers_.ptr(), object.ptr());
  if (found != nullptr) return static_cast<std::uint32_t>(PyLong_AsUnsignedLong(found));
  if (PyErr_Occurred() != nullptr) throw py::error_already_set();
  const auto made = static_cast<std::uint32_t>(objects_.size());
  objects_.push_back(py::reinterpret_borrow<py::object>(object));
  numbers_[object] = made;
  return made;
}

py::object ObjectTable::object(std::uint32_t number) const { return objects_.at(number); }

void ObjectTable::shrink(std::size_t size) {
  while (objects_.size() > size) {
    if (PyDict_DelItem(numbers_.ptr(), objects_.back().ptr()) != 0) PyErr_Clear();
    objects_.pop_back();
  }
}

PythonModel::PythonModel(py::handle model) : model_(model) {
  for (const char* name : {"n_actions", "discount", "reward_range", "initial_state", "step"}) {
    if (!py::hasattr(model_, name)) refuse(std::string(name) + " is missing");
  }
  num_actions_ = model_.attr("n_actions").cast<int>();
  discount_ = model_.attr("discount").cast<double>();
  const auto range = model_.attr("reward_range").cast<std::pair<double, double>>();
  range_ = {range.first, range.second};
  if (py::hasattr(model_, "action_names")) {
    names_ = model_.attr("action_names").cast<std::vector<std::string>>();
  } else {
    for (int a = 0; a < num_actions_; ++a) names_.push_back("a" + std::to_string(a));
  }
  generative::checkNumbers(num_actions_, discount_, names_.size(), range_);
  has_probability_ = py::hasattr(model_, "observation_probability");
  has_upper_bound_ = py::hasattr(model_, "upper_bound");
  has_upper_bounds_ = py::hasattr(model_, "action_upper_bounds");
  has_default_action_ = py::hasattr(model_, "default_action");
  has_lower_bound_ = py::hasattr(model_, "lower_bound_at_horizon");
  has_legal_ = py::hasattr(model_, "legal");
}

PythonModel::State PythonModel::initialState(Random& random) const {
  const py::gil_scoped_acquire gil;
  const py::object stream = py::cast(random);
  const State state{states_.number(model_.attr("initial_state")(stream))};
  random = stream.cast<Random>();
  return state;
}

Step PythonModel::step(State& state, int action, double u) const {
  const py::gil_scoped_acquire gil;
  const py::object result = model_.attr("step")(states_.object(state.number), action, u);
  if (!py::isinstance<py::tuple>(result) || py::len(result) != 4) {
    refuse("step() returned " + py::repr(result).cast<std::string>() +
           ", expected (state, reward, observation, terminal)");
  }
  const auto parts = result.cast<py::tuple>();
  const double reward = finite(parts[1].cast<double>(), "the reward of step()");
  state = {states_.number(parts[0])};
  return {reward, observations_.number(parts[2]), parts[3].cast<bool>()};
}

double PythonModel::observationProbability(const State& next, int action,
                                           Observation observation) const {
  const py::gil_scoped_acquire gil;
  const py::object seen = observations_.object(static_cast<std::uint32_t>(observation));
  const auto p = model_.attr("observation_probability")(states_.object(next.number), action, seen)
                     .cast<double>();
  if (!(p >= 0.0 && p <= 1.0)) {
    refuse("observation_probability() is " + std::to_string(p) + ", expected 0 to 1");
  }
  return p;
}

double PythonModel::upperBound(const State& state) const {
  if (!has_upper_bound_) return range_.high / (1.0 - discount_);
  const py::gil_scoped_acquire gil;
  return finite(model_.attr("upper_bound")(states_.object(state.number)).cast<double>(),
                "upper_bound()");
}

void PythonModel::addUpperBounds(const State& state, double* sums) const {
  if (!has_upper_bounds_) {
    const double bound = upperBound(state);
    for (int a = 0; a < num_actions_; ++a) sums[a] += bound;
    return;
  }
  const py::gil_scoped_acquire gil;
  const auto bounds =
      model_.attr("action_upper_bounds")(states_.object(state.number)).cast<std::vector<double>>();
  if (static_cast<int>(bounds.size()) != num_actions_) {
    refuse("action_upper_bounds() has " + std::to_string(bounds.size()) + " numbers, expected " +
           std::to_string(num_actions_));
  }
  for (const double bound : bounds) *sums++ += finite(bound, "action_upper_bounds()");
}

int PythonModel::defaultAction(const State* states, int count) const {
  const py::gil_scoped_acquire gil;
  py::list list;
  for (int i = 0; i < count; ++i) list.append(states_.object(states[i].number));
  const int action = model_.attr("default_action")(list).cast<int>();
  if (action < 0 || action >= num_actions_) {
    refuse("default_action() is " + std::to_string(action) + ", expected 0 to " +
           std::to_string(num_actions_ - 1));
  }
  return action;
}

double PythonModel::lowerBoundAtHorizon(const State& state) const {
  if (!has_lower_bound_) return range_.low / (1.0 - discount_);
  const py::gil_scoped_acquire gil;
  return finite(model_.attr("lower_bound_at_horizon")(states_.object(state.number)).cast<double>(),
                "lower_bound_at_horizon()");
}

bool PythonModel::legal(const State& state, int action) const {
  if (!has_legal_) return true;
  const py::gil_scoped_acquire gil;
  return model_.attr("legal")(states_.object(state.number), action).cast<bool>();
}

PythonModel::Use::Use(const PythonModel& model, bool temporary)
    : model_(model), temporary_(temporary) {
  const py::gil_scoped_acquire gil;
  ++model_.uses_;
  begun_ = ++model_.begun_;
  mark_ = model_.states_.size();
}

PythonModel::Use::~Use() {
  const py::gil_scoped_acquire gil;
  --model_.uses_;
  const bool alone = model_.uses_ == 0 && model_.begun_ == begun_;
  if (temporary_ && alone) model_.states_.shrink(mark_);
}

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <string>
#include <vector>

#include "fabric_planner/generative.hpp"

namespace fabric::planner {

/// Hashable Python objects by number, in the order they were first met. Call it with the GIL held.
class ObjectTable {
 public:
  std::uint32_t number(pybind11::handle object);
  [[nodiscard]] pybind11::object object(std::uint32_t number) const;
  [[nodiscard]] std::size_t size() const { return objects_.size(); }
  /// Forgets all objects from this number on.
  void shrink(std::size_t size);

 private:
  std::vector<pybind11::object> objects_;
  pybind11::dict numbers_;
};

/// A generative model whose members are methods of a Python object. Every call takes the GIL; what
/// Python raises travels through the planner to its caller.
class PythonModel {
 public:
  struct State {
    std::uint32_t number;  ///< in the table of states
  };

  /// @param model is borrowed: whoever plans with it keeps it alive. @throw ModelError when a
  /// method or attribute is missing or makes no sense.
  explicit PythonModel(pybind11::handle model);

  [[nodiscard]] int numActions() const { return num_actions_; }
  [[nodiscard]] double discount() const { return discount_; }
  [[nodiscard]] std::vector<std::string> actionNames() const { return names_; }
  [[nodiscard]] RewardRange rewardRange() const { return range_; }
  [[nodiscard]] State initialState(Random& random) const;
  [[nodiscard]] Step step(State& state, int action, double u) const;
  [[nodiscard]] bool hasObservationProbability() const { return has_probability_; }
  [[nodiscard]] double observationProbability(const State& next, int action,
                                              Observation observation) const;
  [[nodiscard]] double upperBound(const State& state) const;
  void addUpperBounds(const State& state, double* sums) const;
  [[nodiscard]] bool hasDefaultAction() const { return has_default_action_; }
  [[nodiscard]] int defaultAction(const State* states, int count) const;
  [[nodiscard]] double lowerBoundAtHorizon(const State& state) const;
  [[nodiscard]] bool legal(const State& state, int action) const;

  [[nodiscard]] ObjectTable& states() const { return states_; }
  [[nodiscard]] ObjectTable& observations() const { return observations_; }

  /// While one exists the model is in use. A temporary use that was alone forgets at its end the
  /// states met meanwhile. Construct and destroy with or without the GIL.
  class Use {
   public:
    Use(const PythonModel& model, bool temporary);
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    const PythonModel& model_;
    bool temporary_;
    std::size_t mark_ = 0;
    std::uint64_t begun_ = 0;
  };

 private:
  pybind11::handle model_;
  int num_actions_ = 0;
  double discount_ = 0.0;
  RewardRange range_;
  std::vector<std::string> names_;
  bool has_probability_ = false;
  bool has_upper_bound_ = false;
  bool has_upper_bounds_ = false;
  bool has_default_action_ = false;
  bool has_lower_bound_ = false;
  bool has_legal_ = false;
  mutable ObjectTable states_;
  mutable ObjectTable observations_;
  mutable int uses_ = 0;             // under the GIL, like the next
  mutable std::uint64_t begun_ = 0;  // uses begun so far
};

}  // namespace fabric::planner

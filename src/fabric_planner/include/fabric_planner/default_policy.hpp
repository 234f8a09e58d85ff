// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "fabric_planner/generative.hpp"
#include "fabric_planner/observation_groups.hpp"
#include "fabric_planner/search_clock.hpp"

namespace fabric::planner {

/// A scenario of a determinised model: a start, and from then on one random number for each step
/// (Ye et al. 2017, Section 3). The numbers are not stored: they are a function of seed, scenario
/// and depth.
class ScenarioStreams {
 public:
  explicit ScenarioStreams(std::uint64_t seed = 0) : seed_(mixBits(seed + 1)) {}
  /// In [0, 1).
  [[nodiscard]] double at(std::uint32_t scenario, int depth) const {
    const std::uint64_t place =
        (static_cast<std::uint64_t>(scenario) << 32) | static_cast<std::uint32_t>(depth);
    return toUniform(mixBits(seed_ + (place + 1) * 0x9e3779b97f4a7c15ULL));
  }

 private:
  std::uint64_t seed_;
};

/// What the default policy earns in some scenarios, and its first action.
struct DefaultValue {
  double sum = 0.0;  ///< over the scenarios, discounted to where they stand
  int action = 0;
  bool finished = false;  ///< false: time was up
};

/// Simulates a model's default policy over sets of scenarios. Scenarios that observe different
/// things part, and the policy decides for each set by itself.
template <class Model>
class DefaultPolicy {
 public:
  using State = typename Model::State;

  /// @param depth steps after which a simulation is cut, counted from the root.
  DefaultPolicy(const Model& model, int capacity, int depth)
      : model_(model), depth_(depth), groups_(capacity) {
    const auto size = static_cast<std::size_t>(capacity);
    states_.resize(size);
    sorted_states_.resize(size);
    scenarios_.resize(size);
    sorted_scenarios_.resize(size);
    observations_.resize(size);
    discounts_.resize(static_cast<std::size_t>(depth) + 1, 1.0);
    for (std::size_t d = 1; d < discounts_.size(); ++d) {
      discounts_[d] = discounts_[d - 1] * model.discount();
    }
    stack_.reserve(size);
  }

  /// gamma^depth.
  [[nodiscard]] double discount(int depth) const {
    return discounts_[static_cast<std::size_t>(depth)];
  }
  /// Without a policy of the model's own: the single action that does best for ever, found by
  /// simulation. False when time was up.
  bool prepare(const State* states, const std::uint32_t* scenarios, int count,
               const ScenarioStreams& streams, SearchClock& clock) {
    fixed_action_ = firstLegal(states, count);
    if (generative::HAS_LOWER_BOUND<Model> || generative::hasDefaultAction(model_)) return true;
    const int first = fixed_action_;
    int best = first;
    double most = 0.0;
    for (int a = first; a < model_.numActions(); ++a) {
      if (!generative::legalForAll(model_, states, count, a)) continue;
      fixed_action_ = a;
      const DefaultValue value = simulate(states, scenarios, count, 0, streams, clock);
      if (!value.finished) break;
      if (a == first || value.sum > most) {
        most = value.sum;
        best = a;
      }
    }
    fixed_action_ = best;
    return !clock.expired();
  }

  /// The value from `depth` on, where the scenarios stand.
  DefaultValue value(const State* states, const std::uint32_t* scenarios, int count, int depth,
                     const ScenarioStreams& streams, SearchClock& clock) {
    if constexpr (generative::HAS_LOWER_BOUND<Model>) {
      if (!clock.spend(count)) return {};
      const LowerBound bound = model_.lowerBound(states, count);
      return {bound.value * count, bound.action, true};
    } else {
      return simulate(states, scenarios, count, depth, streams, clock);
    }
  }

  /// An answer when there is no time at all.
  int action(const State* states, int count) const {
    if constexpr (generative::HAS_LOWER_BOUND<Model>) {
      return model_.lowerBound(states, count).action;
    } else {
      return decide(states, count);
    }
  }

 private:
  struct Set {
    std::int32_t begin;
    std::int32_t count;
    std::int32_t depth;
  };

  int firstLegal(const State* states, int count) const {
    int a = 0;
    while (a + 1 < model_.numActions() && !generative::legalForAll(model_, states, count, a)) {
      ++a;
    }
    return a;
  }

  int decide([[maybe_unused]] const State* states, [[maybe_unused]] int count) const {
    if constexpr (generative::HAS_DEFAULT_ACTION<Model>) {
      if (generative::hasDefaultAction(model_)) return model_.defaultAction(states, count);
    }
    return fixed_action_;
  }

  DefaultValue simulate(const State* states, const std::uint32_t* scenarios, int count, int depth,
                        const ScenarioStreams& streams, SearchClock& clock) {
    DefaultValue value;
    value.action = decide(states, count);
    std::copy(states, states + count, states_.begin());
    std::copy(scenarios, scenarios + count, scenarios_.begin());
    stack_.assign(1, Set{0, count, depth});
    while (!stack_.empty()) {
      Set set = stack_.back();
      stack_.pop_back();
      if (!follow(set, depth, streams, clock, value.sum)) return value;
    }
    value.finished = true;
    return value;
  }

  /// Moves a set on until it ends or parts; the parts go onto the stack. False: time was up.
  bool follow(Set set, int start, const ScenarioStreams& streams, SearchClock& clock, double& sum) {
    State* states = states_.data() + set.begin;
    std::uint32_t* scenarios = scenarios_.data() + set.begin;
    while (set.count > 0 && set.depth < depth_) {
      const int action = decide(states, set.count);
      double reward = 0.0;
      int left = 0;
      for (int i = 0; i < set.count; ++i) {
        if (!clock.spend(1)) return false;
        State state = states[i];
        const std::uint32_t scenario = scenarios[i];
        const Step step = model_.step(state, action, streams.at(scenario, set.depth));
        reward += step.reward;
        if (step.terminal) continue;
        states[left] = state;
        scenarios[left] = scenario;
        observations_[static_cast<std::size_t>(left++)] = step.observation;
      }
      sum += discount(set.depth - start) * reward;
      set.count = left;
      ++set.depth;
      if (left > 1 && generative::hasDefaultAction(model_) && part(set)) return true;
    }
    for (int i = 0; i < set.count; ++i) {
      sum += discount(set.depth - start) * generative::lowerBoundAtHorizon(model_, states[i]);
    }
    return true;
  }

  /// Sorts a set by what was observed. False when all observed the same.
  bool part(Set set) {
    const int parts = groups_.group(observations_.data(), set.count);
    if (parts == 1) return false;
    State* states = states_.data() + set.begin;
    std::uint32_t* scenarios = scenarios_.data() + set.begin;
    for (int i = 0; i < set.count; ++i) {
      const auto from = groups_.order()[i];
      sorted_states_[static_cast<std::size_t>(i)] = states[from];
      sorted_scenarios_[static_cast<std::size_t>(i)] = scenarios[from];
    }
    std::copy_n(sorted_states_.begin(), set.count, states);
    std::copy_n(sorted_scenarios_.begin(), set.count, scenarios);
    for (int g = 0; g < parts; ++g) {
      stack_.push_back(Set{set.begin, groups_.size(g), set.depth});
      set.begin += groups_.size(g);
    }
    return true;
  }

  const Model& model_;
  int depth_;
  int fixed_action_ = 0;
  ObservationGroups groups_;
  std::vector<State> states_;  // of the sets on the stack, each in its own stretch
  std::vector<std::uint32_t> scenarios_;
  std::vector<State> sorted_states_;
  std::vector<std::uint32_t> sorted_scenarios_;
  std::vector<Observation> observations_;
  std::vector<double> discounts_;
  std::vector<Set> stack_;
};

}  // namespace fabric::planner

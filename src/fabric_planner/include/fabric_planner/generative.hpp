// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "fabric_planner/random.hpp"

/// \file
/// What a model has to offer so that Despot, Pomcp, ParticleBelief and runEpisode() can use it.
///
/// A model is any class like this one; nothing is inherited and every call is inlined:
/// \code
/// struct Model {
///   using State = ...;  // trivially copyable, as small as it can be
///
///   // --- required ---------------------------------------------------------------------------
///   int numActions() const;                          // >= 1
///   double discount() const;                         // in (0, 1)
///   std::vector<std::string> actionNames() const;    // (A,)
///   RewardRange rewardRange() const;                 // of one step
///   State initialState(Random& random) const;        // a draw from the initial belief
///   Step step(State& state, int action, double u) const;  // moves the state; a function of
///                                                         // (state, action, u), u in [0, 1)
///   // --- optional: leave out what is not known ----------------------------------------------
///   // P(o | action, next). Without it beliefs keep the particles that simulate o themselves.
///   double observationProbability(const State& next, int action, Observation o) const;
///   bool hasObservationProbability() const;  // only for adapters that learn it at run time
///   // At least the optimal value from a known state. Without: max reward / (1 - discount).
///   double upperBound(const State& state) const;
///   // Adds to sums[a], for every action a, at least the value of a and the best behaviour after
///   // it (QMDP, fast informed bound). Sharper than upperBound(), which it replaces, since the
///   // best action is chosen after summing over states.
///   void addUpperBounds(const State& state, double* sums) const;
///   // Default policy: the action to take when all that is known are these equally likely states.
///   // Its simulated value is the lower bound. Without: one action for ever, the best in
///   // simulation from the root.
///   int defaultAction(const State* states, int count) const;
///   bool hasDefaultAction() const;  // only for adapters that learn it at run time
///   // A lower bound found otherwise: the value of some policy, averaged over the equally likely
///   // states, and its first action. Replaces the simulation of defaultAction().
///   LowerBound lowerBound(const State* states, int count) const;
///   // At most the value of the default policy from a state at the end of a simulation. Without:
///   // min reward / (1 - discount).
///   double lowerBoundAtHorizon(const State& state) const;
///   // May the action be taken? At a belief it may when every possible state allows it; each state
///   // must allow one.
///   bool legal(const State& state, int action) const;
///   // The belief to run this model with, when there is a better one than particles.
///   std::unique_ptr<Belief<State>> makeBelief(std::uint64_t seed) const;   // at its initial
///   belief
///   // A state to put in place of the particles an observation made impossible.
///   State recover(int action, Observation o, Random& random) const;
/// };
/// \endcode
/// Calls must be const and safe from several threads unless the model's owner uses one thread. A
/// state in which the episode has ended is never stepped again.
namespace fabric::planner {

/// A packed observation; equal numbers are the same observation.
using Observation = std::uint64_t;

/// What one step gave.
struct Step {
  double reward = 0.0;
  Observation observation = 0;
  bool terminal = false;  ///< the episode has ended; no reward comes after this one
};

/// Bounds on the reward of one step, finite, low <= high.
struct RewardRange {
  double low = 0.0;
  double high = 0.0;
};

/// The value of a policy, and what it does first.
struct LowerBound {
  double value = 0.0;
  int action = 0;
};

namespace generative {

/// Does the call exist? One constant for each member of the concept.
#define FABRIC_HAS(CONSTANT, ...)                                                 \
  template <class M, class = void>                                                \
  struct CONSTANT##_T : std::false_type {};                                       \
  template <class M>                                                              \
  struct CONSTANT##_T<M, std::void_t<decltype(__VA_ARGS__)>> : std::true_type {}; \
  template <class M>                                                              \
  inline constexpr bool CONSTANT = CONSTANT##_T<M>::value;

template <class M>
const M& model();
template <class M>
const typename M::State& state();
template <class M>
typename M::State& mutableState();

FABRIC_HAS(HAS_STATE, std::declval<typename M::State>())
FABRIC_HAS(HAS_NUM_ACTIONS, static_cast<int>(model<M>().numActions()))
FABRIC_HAS(HAS_DISCOUNT, static_cast<double>(model<M>().discount()))
FABRIC_HAS(HAS_ACTION_NAMES, static_cast<std::vector<std::string>>(model<M>().actionNames()))
FABRIC_HAS(HAS_REWARD_RANGE, static_cast<RewardRange>(model<M>().rewardRange()))
FABRIC_HAS(HAS_INITIAL_STATE,
           static_cast<typename M::State>(model<M>().initialState(std::declval<Random&>())))
FABRIC_HAS(HAS_STEP, static_cast<Step>(model<M>().step(mutableState<M>(), 0, 0.0)))
FABRIC_HAS(HAS_OBSERVATION_PROBABILITY,
           static_cast<double>(model<M>().observationProbability(state<M>(), 0, Observation{})))
FABRIC_HAS(ASKS_FOR_OBSERVATION_PROBABILITY,
           static_cast<bool>(model<M>().hasObservationProbability()))
FABRIC_HAS(HAS_UPPER_BOUND, static_cast<double>(model<M>().upperBound(state<M>())))
FABRIC_HAS(HAS_ADD_UPPER_BOUNDS,
           model<M>().addUpperBounds(state<M>(), static_cast<double*>(nullptr)))
FABRIC_HAS(HAS_DEFAULT_ACTION,
           static_cast<int>(model<M>().defaultAction(static_cast<const typename M::State*>(nullptr),
                                                     0)))
FABRIC_HAS(ASKS_FOR_DEFAULT_ACTION, static_cast<bool>(model<M>().hasDefaultAction()))
FABRIC_HAS(HAS_LOWER_BOUND, static_cast<LowerBound>(model<M>().lowerBound(
                                static_cast<const typename M::State*>(nullptr), 0)))
FABRIC_HAS(HAS_LOWER_BOUND_AT_HORIZON,
           static_cast<double>(model<M>().lowerBoundAtHorizon(state<M>())))
FABRIC_HAS(HAS_LEGAL, static_cast<bool>(model<M>().legal(state<M>(), 0)))
FABRIC_HAS(HAS_MAKE_BELIEF, model<M>().makeBelief(std::uint64_t{}))
FABRIC_HAS(HAS_RECOVER, static_cast<typename M::State>(model<M>().recover(0, Observation{},
                                                                          std::declval<Random&>())))
#undef FABRIC_HAS

/// Stops the compiler with a sentence when a required member is missing.
template <class M>
constexpr void checkConcept() {
  static_assert(HAS_STATE<M>, "a generative model needs a type State");
  static_assert(std::is_trivially_copyable_v<typename M::State>,
                "State must be trivially copyable: keep an index to what is not");
  static_assert(HAS_NUM_ACTIONS<M>, "a generative model needs: int numActions() const");
  static_assert(HAS_DISCOUNT<M>, "a generative model needs: double discount() const");
  static_assert(HAS_ACTION_NAMES<M>,
                "a generative model needs: std::vector<std::string> actionNames() const");
  static_assert(HAS_REWARD_RANGE<M>, "a generative model needs: RewardRange rewardRange() const");
  static_assert(HAS_INITIAL_STATE<M>,
                "a generative model needs: State initialState(Random&) const");
  static_assert(HAS_STEP<M>,
                "a generative model needs: Step step(State&, int action, double u) const");
}

/// May observationProbability() be called?
template <class M>
bool hasObservationProbability(const M& m) {
  if constexpr (ASKS_FOR_OBSERVATION_PROBABILITY<M>) {
    return m.hasObservationProbability();
  } else {
    return HAS_OBSERVATION_PROBABILITY<M>;
  }
}

/// May defaultAction() be called?
template <class M>
bool hasDefaultAction(const M& m) {
  if constexpr (ASKS_FOR_DEFAULT_ACTION<M>) {
    return m.hasDefaultAction();
  } else {
    return HAS_DEFAULT_ACTION<M>;
  }
}

/// At least the optimal value from a known state.
template <class M>
double upperBound(const M& m, const typename M::State& s) {
  if constexpr (HAS_UPPER_BOUND<M>) {
    return m.upperBound(s);
  } else {
    return m.rewardRange().high / (1.0 - m.discount());
  }
}

/// At most what the default policy earns from a state where its simulation is cut.
template <class M>
double lowerBoundAtHorizon(const M& m, const typename M::State& s) {
  if constexpr (HAS_LOWER_BOUND_AT_HORIZON<M>) {
    return m.lowerBoundAtHorizon(s);
  } else {
    return m.rewardRange().low / (1.0 - m.discount());
  }
}

template <class M>
bool legal(const M& m, const typename M::State& s, int action) {
  if constexpr (HAS_LEGAL<M>) {
    return m.legal(s, action);
  } else {
    return true;
  }
}

/// May the action be taken in each of the states?
template <class M>
bool legalForAll([[maybe_unused]] const M& m, [[maybe_unused]] const typename M::State* states,
                 [[maybe_unused]] int count, [[maybe_unused]] int action) {
  if constexpr (HAS_LEGAL<M>) {
    for (int i = 0; i < count; ++i) {
      if (!m.legal(states[i], action)) return false;
    }
  }
  return true;
}

/// Throws ModelError unless numActions, discount, names and reward range make sense.
void checkNumbers(int actions, double discount, std::size_t names, RewardRange range);

/// Throws ModelError unless both are in range.
void checkParticles(int particles, int recovery_tries);

template <class M>
void check(const M& m) {
  checkConcept<M>();
  checkNumbers(m.numActions(), m.discount(), m.actionNames().size(), m.rewardRange());
}

}  // namespace generative
}  // namespace fabric::planner

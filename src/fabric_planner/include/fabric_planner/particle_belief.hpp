// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "fabric_planner/belief_filter.hpp"
#include "fabric_planner/generative.hpp"

namespace fabric::planner {

/// What is believed about the state of a generative model.
///
/// Two kinds exist: ParticleBelief for any model, and exact beliefs that a model brings along
/// (makeBelief() in its concept). Whoever holds one need not know which.
template <class State>
class Belief {
 public:
  virtual ~Belief() = default;
  /// Back to the initial belief; random draws start again from the seed.
  virtual void reset(std::uint64_t seed) = 0;
  /// Conditions on an action carried out and on what was observed after it. Never fails: an
  /// observation without any chance is told by RECOVERED and counted.
  virtual UpdateStatus update(int action, Observation observation) = 0;
  /// `count` draws into out[0 .. count - 1], spread evenly over the belief (systematic sampling,
  /// Carpenter et al. 1999) and in no particular order.
  virtual void sample(Random& random, int count, State* out) const = 0;
  /// One draw.
  State sample(Random& random) const {
    State state;
    sample(random, 1, &state);
    return state;
  }
  /// Updates since the last reset that needed the recovery.
  [[nodiscard]] virtual std::uint64_t recoveries() const = 0;
};

/// Calls take(index) `count` times, index i in proportion to weights[i]: one uniform number,
/// evenly spaced. @param total sum of the weights, > 0.
template <class Take>
void systematicDraw(Random& random, const double* weights, int size, double total, int count,
                    Take take) {
  const double spacing = total / count;
  double next = random.uniform() * spacing;
  double below = 0.0;
  int last = 0;
  int taken = 0;
  for (int i = 0; i < size && taken < count; ++i) {
    if (weights[i] <= 0.0) continue;
    last = i;
    below += weights[i];
    for (; taken < count && next < below; ++taken, next += spacing) take(i);
  }
  for (; taken < count; ++taken) take(last);  // what rounding left over
}

/// Puts an array into random order (Fisher & Yates).
template <class T>
void shuffle(Random& random, T* items, int count) {
  for (int i = count - 1; i > 0; --i) std::swap(items[i], items[random.below(i + 1)]);
}

struct ParticleOptions {
  int particles = 5000;     ///< kept after every update, >= 1
  int recovery_tries = 10;  ///< clouds drawn again before the observation is given up, >= 0
};

/// A belief as a cloud of equally likely states (sequential importance resampling, Gordon et al.
/// 1993).
///
/// An update moves each particle by the model's step, weighs it by P(o | a, s') and draws the new
/// cloud systematically from the weights; particles whose episode ended weigh nothing, since there
/// was an observation to update on. A model without observationProbability() weighs by whether the
/// step gave the observation itself. When every weight is zero (deprivation):
///   1. the cloud is moved again with other random numbers, then fresh draws of the initial belief
///      are moved by the action, in turn, `recovery_tries` times in all;
///   2. a model that offers recover() then supplies the states;
///   3. without it the moved cloud stays unweighted: nothing was learnt.
/// Whenever fresh draws or step 2 or 3 were needed the update says RECOVERED and is counted.
template <class Model>
class ParticleBelief final : public Belief<typename Model::State> {
 public:
  using State = typename Model::State;

  /// @param model outlives the belief. @throw ModelError when an option is out of range.
  ParticleBelief(const Model& model, std::uint64_t seed, ParticleOptions options = {})
      : model_(model), options_(options), random_(seed) {
    generative::check(model);
    generative::checkParticles(options.particles, options.recovery_tries);
    const auto size = static_cast<std::size_t>(options.particles);
    particles_.resize(size);
    moved_.resize(size);
    weights_.resize(size);
    reset(seed);
  }

  void reset(std::uint64_t seed) override {
    random_ = Random(seed);
    recoveries_ = 0;
    for (State& particle : particles_) particle = model_.initialState(random_);
  }

  UpdateStatus update(int action, Observation observation) override {
    if (move(action, observation)) return UpdateStatus::OK;
    for (int i = 0; i < options_.recovery_tries; ++i) {
      const bool fresh = i % 2 == 1;
      if (fresh) drawFresh();
      if (!move(action, observation)) continue;
      recoveries_ += fresh ? 1 : 0;
      return fresh ? UpdateStatus::RECOVERED : UpdateStatus::OK;
    }
    if constexpr (generative::HAS_RECOVER<Model>) {
      for (State& particle : moved_) particle = model_.recover(action, observation, random_);
    }
    particles_.swap(moved_);
    ++recoveries_;
    return UpdateStatus::RECOVERED;
  }

  using Belief<State>::sample;
  void sample(Random& random, int count, State* out) const override {
    const int size = options_.particles;
    const double spacing = static_cast<double>(size) / count;
    double next = random.uniform() * spacing;
    for (int i = 0; i < count; ++i, next += spacing) {
      out[i] = particles_[static_cast<std::size_t>(std::min(static_cast<int>(next), size - 1))];
    }
    shuffle(random, out, count);
  }

  [[nodiscard]] std::uint64_t recoveries() const override { return recoveries_; }
  [[nodiscard]] const std::vector<State>& particles() const { return particles_; }

 private:
  /// False, with the cloud as it was, when the observation has no chance.
  bool move(int action, Observation observation) {
    const bool weigh = generative::hasObservationProbability(model_);
    double total = 0.0;
    for (std::size_t i = 0; i < particles_.size(); ++i) {
      moved_[i] = particles_[i];
      const Step step = model_.step(moved_[i], action, random_.uniform());
      weights_[i] = step.terminal ? 0.0 : weight(moved_[i], action, step, observation, weigh);
      total += weights_[i];
    }
    if (!(total > 0.0)) return false;
    auto next = particles_.begin();
    systematicDraw(random_, weights_.data(), options_.particles, total, options_.particles,
                   [&](int i) { *next++ = moved_[static_cast<std::size_t>(i)]; });
    return true;
  }

  double weight([[maybe_unused]] const State& next, [[maybe_unused]] int action, const Step& step,
                Observation observation, bool weigh) const {
    if constexpr (generative::HAS_OBSERVATION_PROBABILITY<Model>) {
      if (weigh) return model_.observationProbability(next, action, observation);
    }
    return step.observation == observation ? 1.0 : 0.0;
  }

  void drawFresh() {
    for (State& particle : particles_) particle = model_.initialState(random_);
  }

  const Model& model_;
  ParticleOptions options_;
  Random random_;
  std::vector<State> particles_;
  std::vector<State> moved_;     // the cloud after the action, before the weights
  std::vector<double> weights_;  // of moved_
  std::uint64_t recoveries_ = 0;
};

/// The belief a model asks for, else particles; at the model's initial belief.
template <class Model>
std::unique_ptr<Belief<typename Model::State>> makeBelief(const Model& model, std::uint64_t seed,
                                                          ParticleOptions options = {}) {
  if constexpr (generative::HAS_MAKE_BELIEF<Model>) {
    return model.makeBelief(seed);
  } else {
    return std::make_unique<ParticleBelief<Model>>(model, seed, options);
  }
}

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "fabric_planner/despot.hpp"
#include "fabric_planner/episodes.hpp"
#include "fabric_planner/pomcp.hpp"
#include "python_model.hpp"

namespace fabric::planner {

class AnyModel;

/// Belief<State> without its State. Called with the GIL held, which is given up meanwhile.
class AnyBelief {
 public:
  virtual ~AnyBelief() = default;
  virtual void reset(std::uint64_t seed) = 0;
  virtual UpdateStatus update(int action, pybind11::handle observation) = 0;
  virtual pybind11::list sample(int count, std::uint64_t seed) = 0;
  virtual std::uint64_t recoveries() = 0;
};

/// Despot<Model> or Pomcp<Model> without its Model.
class AnyPlanner {
 public:
  virtual ~AnyPlanner() = default;
  virtual Decision decide(AnyBelief& belief) = 0;
  virtual void advance(int action, pybind11::handle observation) = 0;
  virtual void reset(std::uint64_t seed) = 0;
  virtual std::size_t memory() = 0;
};

struct AnyStep {
  pybind11::object state;
  double reward;
  pybind11::object observation;
  bool terminal;
};

/// A generative model without its type.
class AnyModel {
 public:
  virtual ~AnyModel() = default;
  [[nodiscard]] virtual int numActions() const = 0;
  [[nodiscard]] virtual double discount() const = 0;
  [[nodiscard]] virtual std::vector<std::string> actionNames() const = 0;
  [[nodiscard]] virtual RewardRange rewardRange() const = 0;
  virtual pybind11::object initialState(std::uint64_t seed) = 0;
  virtual AnyStep step(pybind11::handle state, int action, double u) = 0;
  virtual double observationProbability(pybind11::handle next, int action,
                                        pybind11::handle observation) = 0;
  /// The model's own belief, if it brings one, else particles.
  virtual std::unique_ptr<AnyBelief> makeBelief(std::uint64_t seed) = 0;
  virtual std::unique_ptr<AnyBelief> makeParticles(std::uint64_t seed, ParticleOptions options) = 0;
  virtual std::unique_ptr<AnyPlanner> makePlanner(const DespotOptions& options) = 0;
  virtual std::unique_ptr<AnyPlanner> makePlanner(const PomcpOptions& options) = 0;
  virtual std::vector<Episode> evaluate(const DespotOptions& options, int episodes,
                                        std::uint64_t seed, const EpisodeOptions& limits) = 0;
  virtual std::vector<Episode> evaluate(const PomcpOptions& options, int episodes,
                                        std::uint64_t seed, const EpisodeOptions& limits) = 0;
};

/// What Python sees of a model's states and observations, and how long it has to keep them.
template <class Model>
struct Translation {
  using State = typename Model::State;
  struct Use {
    Use(const Model& /*model*/, bool /*temporary*/) {}
  };

  static pybind11::object give(const Model& /*model*/, const State& state) {
    if constexpr (std::is_integral_v<State>) {
      return pybind11::int_(state);
    } else {
      return pybind11::bytes(reinterpret_cast<const char*>(&state), sizeof(State));
    }
  }
  static State take(const Model& /*model*/, pybind11::handle given) {
    if constexpr (std::is_integral_v<State>) {
      return given.cast<State>();
    } else {
      const auto bytes = given.cast<std::string>();
      if (bytes.size() != sizeof(State)) {
        throw ModelError("a state has " + std::to_string(sizeof(State)) + " bytes, given " +
                         std::to_string(bytes.size()));
      }
      State state;
      std::memcpy(&state, bytes.data(), sizeof(State));
      return state;
    }
  }
  static pybind11::object giveObservation(const Model& /*model*/, Observation observation) {
    return pybind11::int_(observation);
  }
  static Observation takeObservation(const Model& /*model*/, pybind11::handle given) {
    return given.cast<Observation>();
  }
};

template <>
struct Translation<PythonModel> {
  using State = PythonModel::State;
  using Use = PythonModel::Use;
  static pybind11::object give(const PythonModel& model, State state) {
    return model.states().object(state.number);
  }
  static State take(const PythonModel& model, pybind11::handle given) {
    return {model.states().number(given)};
  }
  static pybind11::object giveObservation(const PythonModel& model, Observation observation) {
    return model.observations().object(static_cast<std::uint32_t>(observation));
  }
  static Observation takeObservation(const PythonModel& model, pybind11::handle given) {
    return model.observations().number(given);
  }
};

inline void checkAction(int action, int actions) {
  if (action < 0 || action >= actions) {
    throw std::out_of_range("action " + std::to_string(action) + ", expected 0 to " +
                            std::to_string(actions - 1));
  }
}

template <class Model>
class BeliefOf final : public AnyBelief {
 public:
  using Of = Translation<Model>;
  using Inner = Belief<typename Model::State>;

  /// make() gives the belief; it may call the model.
  template <class Make>
  BeliefOf(std::shared_ptr<const Model> model, const Make& make) : model_(std::move(model)) {
    const pybind11::gil_scoped_release release;
    const typename Of::Use use(*model_, false);
    belief_ = make(*model_);
  }
  void reset(std::uint64_t seed) override {
    locked([&] { belief_->reset(seed); });
  }
  UpdateStatus update(int action, pybind11::handle observation) override {
    checkAction(action, model_->numActions());
    const Observation seen = Of::takeObservation(*model_, observation);
    auto status = UpdateStatus::OK;
    locked([&] { status = belief_->update(action, seen); });
    return status;
  }
  pybind11::list sample(int count, std::uint64_t seed) override {
    if (count < 0) throw ModelError("count is " + std::to_string(count) + ", expected >= 0");
    std::vector<typename Model::State> states(static_cast<std::size_t>(count));
    Random random(seed);
    if (count > 0) locked([&] { belief_->sample(random, count, states.data()); });
    pybind11::list list;
    for (const auto& state : states) list.append(Of::give(*model_, state));
    return list;
  }
  std::uint64_t recoveries() override {
    std::uint64_t count = 0;
    locked([&] { count = belief_->recoveries(); });
    return count;
  }
  [[nodiscard]] const Model* model() const { return model_.get(); }
  /// Calls with the belief while no other thread changes it; without the GIL.
  template <class Call>
  void with(const Call& call) {
    const std::lock_guard<std::mutex> lock(mutex_);
    call(*belief_);
  }

 private:
  template <class Call>
  void locked(const Call& call) {
    const pybind11::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(mutex_);
    const typename Of::Use use(*model_, false);
    call();
  }

  std::shared_ptr<const Model> model_;
  std::unique_ptr<Inner> belief_;
  std::mutex mutex_;
};

template <class Model, class Planner>
class PlannerOf final : public AnyPlanner {
 public:
  using Of = Translation<Model>;

  template <class Options>
  PlannerOf(std::shared_ptr<const Model> model, const Options& options)
      : model_(std::move(model)), planner_(*model_, options) {}
  Decision decide(AnyBelief& any) override {
    auto* belief = dynamic_cast<BeliefOf<Model>*>(&any);
    if (belief == nullptr || belief->model() != model_.get()) {
      throw ModelError("the belief is one of another model than the planner's");
    }
    Decision decision;
    const pybind11::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(mutex_);
    const typename Of::Use use(*model_, true);
    belief->with([&](const auto& inner) { decision = planner_.decide(inner); });
    return decision;
  }
  void advance(int action, pybind11::handle observation) override {
    checkAction(action, model_->numActions());
    if constexpr (generative::KeepsTree<Planner>::value) {
      const Observation seen = Of::takeObservation(*model_, observation);
      const pybind11::gil_scoped_release release;
      const std::lock_guard<std::mutex> lock(mutex_);
      planner_.advance(action, seen);
    }
  }
  void reset(std::uint64_t seed) override {
    const pybind11::gil_scoped_release release;
    const std::lock_guard<std::mutex> lock(mutex_);
    planner_.reset(seed);
  }
  std::size_t memory() override { return planner_.options().memory; }

 private:
  std::shared_ptr<const Model> model_;
  Planner planner_;
  std::mutex mutex_;
};

template <class Model>
class ModelOf final : public AnyModel {
 public:
  using Of = Translation<Model>;

  explicit ModelOf(std::shared_ptr<const Model> model) : model_(std::move(model)) {
    generative::check(*model_);
  }
  [[nodiscard]] int numActions() const override { return model_->numActions(); }
  [[nodiscard]] double discount() const override { return model_->discount(); }
  [[nodiscard]] std::vector<std::string> actionNames() const override {
    return model_->actionNames();
  }
  [[nodiscard]] RewardRange rewardRange() const override { return model_->rewardRange(); }
  pybind11::object initialState(std::uint64_t seed) override {
    Random random(seed);
    return Of::give(*model_, model_->initialState(random));
  }
  AnyStep step(pybind11::handle given, int action, double u) override {
    checkAction(action, numActions());
    if (!(u >= 0.0 && u < 1.0)) throw ModelError("u is " + std::to_string(u) + ", not in [0, 1)");
    auto state = Of::take(*model_, given);
    const Step step = model_->step(state, action, u);
    return {Of::give(*model_, state), step.reward, Of::giveObservation(*model_, step.observation),
            step.terminal};
  }
  double observationProbability(pybind11::handle next, int action,
                                pybind11::handle observation) override {
    checkAction(action, numActions());
    if constexpr (generative::HAS_OBSERVATION_PROBABILITY<Model>) {
      if (generative::hasObservationProbability(*model_)) {
        return model_->observationProbability(Of::take(*model_, next), action,
                                              Of::takeObservation(*model_, observation));
      }
    }
    throw ModelError("the model has no observation_probability");
  }
  std::unique_ptr<AnyBelief> makeBelief(std::uint64_t seed) override {
    return std::make_unique<BeliefOf<Model>>(
        model_, [&](const Model& model) { return planner::makeBelief(model, seed); });
  }
  std::unique_ptr<AnyBelief> makeParticles(std::uint64_t seed, ParticleOptions options) override {
    return std::make_unique<BeliefOf<Model>>(model_, [&](const Model& model) {
      return std::make_unique<ParticleBelief<Model>>(model, seed, options);
    });
  }
  std::unique_ptr<AnyPlanner> makePlanner(const DespotOptions& options) override {
    return std::make_unique<PlannerOf<Model, Despot<Model>>>(model_, options);
  }
  std::unique_ptr<AnyPlanner> makePlanner(const PomcpOptions& options) override {
    return std::make_unique<PlannerOf<Model, Pomcp<Model>>>(model_, options);
  }
  std::vector<Episode> evaluate(const DespotOptions& options, int episodes, std::uint64_t seed,
                                const EpisodeOptions& limits) override {
    return run<Despot<Model>>(options, episodes, seed, limits);
  }
  std::vector<Episode> evaluate(const PomcpOptions& options, int episodes, std::uint64_t seed,
                                const EpisodeOptions& limits) override {
    return run<Pomcp<Model>>(options, episodes, seed, limits);
  }

 private:
  template <class Planner, class Options>
  std::vector<Episode> run(const Options& options, int episodes, std::uint64_t seed,
                           const EpisodeOptions& limits) {
    Planner planner(*model_, options);
    std::vector<Episode> all;
    for (int i = 0; i < episodes; ++i) {
      if (PyErr_CheckSignals() != 0) throw pybind11::error_already_set();
      const pybind11::gil_scoped_release release;
      const typename Of::Use use(*model_, true);
      const std::uint64_t number = seed + static_cast<std::uint64_t>(i);
      const auto belief = planner::makeBelief(*model_, number);
      all.push_back(runEpisode(*model_, planner, *belief, number, limits));
    }
    return all;
  }

  std::shared_ptr<const Model> model_;
};

}  // namespace fabric::planner

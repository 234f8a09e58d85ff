// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <time.h>

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "fabric_planner/decision.hpp"
#include "fabric_planner/particle_belief.hpp"

namespace fabric::planner {

struct EpisodeOptions {
  int max_steps = 90;  ///< >= 1
};

/// One simulated episode.
struct Episode {
  double discounted = 0.0;    ///< return: sum of gamma^t r_t
  double undiscounted = 0.0;  ///< sum of r_t
  int steps = 0;
  bool terminal = false;  ///< false: max_steps was reached
  std::int64_t trials = 0;
  std::int64_t nodes = 0;
  std::uint64_t recoveries = 0;       ///< of the belief
  std::vector<double> planning_time;  ///< s of thread CPU time, per step
  double belief_time = 0.0;           ///< s of thread CPU time, in all
};

/// s of CPU time of this thread.
inline double threadTime() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

namespace generative {

template <class Planner, class = void>
struct KeepsTree : std::false_type {};
template <class Planner>
struct KeepsTree<Planner, std::void_t<decltype(std::declval<Planner&>().advance(0, Observation{}))>>
    : std::true_type {};

}  // namespace generative

/// Simulates one episode: state and steps from the seed, decisions by planner.decide(belief).
///
/// The true state and its random numbers are the same for every planner that is given the same
/// seed and does the same. The belief starts at its initial one. planner.reset(seed) is called
/// first; a planner that keeps its tree is told planner.advance(action, observation).
template <class Model, class Planner>
Episode runEpisode(const Model& model, Planner& planner, Belief<typename Model::State>& belief,
                   std::uint64_t seed, const EpisodeOptions& options = {}) {
  Episode episode;
  Random random = Random(seed).child(1);
  typename Model::State state = model.initialState(random);
  planner.reset(Random(seed).child(2).bits());
  belief.reset(Random(seed).child(3).bits());
  double weight = 1.0;
  while (episode.steps < options.max_steps && !episode.terminal) {
    const double start = threadTime();
    const Decision decision = planner.decide(belief);
    const double decided = threadTime();
    const Step step = model.step(state, decision.action, random.uniform());
    episode.planning_time.push_back(decided - start);
    episode.trials += decision.trials;
    episode.nodes += decision.nodes;
    episode.discounted += weight * step.reward;
    episode.undiscounted += step.reward;
    episode.terminal = step.terminal;
    weight *= model.discount();
    ++episode.steps;
    if (step.terminal) break;
    const double stepped = threadTime();
    belief.update(decision.action, step.observation);
    episode.belief_time += threadTime() - stepped;
    if constexpr (generative::KeepsTree<Planner>::value) {
      planner.advance(decision.action, step.observation);
    }
  }
  episode.recoveries = belief.recoveries();
  return episode;
}

/// Episodes with the seeds seed, seed + 1 and so on, one after the other.
template <class Model, class Planner>
std::vector<Episode> runEpisodes(const Model& model, Planner& planner, int count,
                                 std::uint64_t seed, const EpisodeOptions& options = {}) {
  std::vector<Episode> episodes;
  episodes.reserve(static_cast<std::size_t>(count));
  const auto belief = makeBelief(model, seed);
  for (int i = 0; i < count; ++i) {
    episodes.push_back(
        runEpisode(model, planner, *belief, seed + static_cast<std::uint64_t>(i), options));
  }
  return episodes;
}

/// What a set of episodes says, with the standard error of the mean.
struct EpisodeSummary {
  int episodes = 0;
  double discounted = 0.0;  ///< mean
  double discounted_error = 0.0;
  double undiscounted = 0.0;  ///< mean
  double undiscounted_error = 0.0;
  double steps = 0.0;              ///< mean
  double trials_per_second = 0.0;  ///< of planning
  double trials_per_step = 0.0;
  double planning_median = 0.0;  ///< s a step
  double planning_p99 = 0.0;     ///< s a step
  double planning_max = 0.0;     ///< s a step
  double belief_time = 0.0;      ///< s a step, mean
  std::uint64_t recoveries = 0;
};
EpisodeSummary summarise(const std::vector<Episode>& episodes);

}  // namespace fabric::planner

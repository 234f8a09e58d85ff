// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/episodes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace fabric::planner {
namespace {

/// Mean, and the standard error of the mean (0 for a single value).
std::pair<double, double> mean(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  const double average = std::accumulate(values.begin(), values.end(), 0.0) / n;
  if (values.size() < 2) return {average, 0.0};
  double squares = 0.0;
  for (const double v : values) squares += (v - average) * (v - average);
  return {average, std::sqrt(squares / (n - 1.0) / n)};
}

double quantile(const std::vector<double>& sorted, double share) {
  const auto last = static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<std::size_t>(std::ceil(share * last))];
}

void summariseTimes(const std::vector<Episode>& episodes, EpisodeSummary& summary) {
  std::vector<double> times;
  double trials = 0.0;
  double belief = 0.0;
  for (const Episode& episode : episodes) {
    times.insert(times.end(), episode.planning_time.begin(), episode.planning_time.end());
    trials += static_cast<double>(episode.trials);
    belief += episode.belief_time;
    summary.recoveries += episode.recoveries;
  }
  if (times.empty()) return;
  std::sort(times.begin(), times.end());
  const auto steps = static_cast<double>(times.size());
  const double total = std::accumulate(times.begin(), times.end(), 0.0);
  summary.steps = steps / summary.episodes;
  summary.trials_per_step = trials / steps;
  summary.trials_per_second = total > 0.0 ? trials / total : 0.0;
  summary.planning_median = quantile(times, 0.5);
  summary.planning_p99 = quantile(times, 0.99);
  summary.planning_max = times.back();
  summary.belief_time = belief / steps;
}

}  // namespace

EpisodeSummary summarise(const std::vector<Episode>& episodes) {
  EpisodeSummary summary;
  summary.episodes = static_cast<int>(episodes.size());
  if (episodes.empty()) return summary;
  std::vector<double> discounted;
  std::vector<double> undiscounted;
  for (const Episode& episode : episodes) {
    discounted.push_back(episode.discounted);
    undiscounted.push_back(episode.undiscounted);
  }
  std::tie(summary.discounted, summary.discounted_error) = mean(discounted);
  std::tie(summary.undiscounted, summary.undiscounted_error) = mean(undiscounted);
  summariseTimes(episodes, summary);
  return summary;
}

}  // namespace fabric::planner

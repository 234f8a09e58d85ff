// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/evaluate.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <string>
#include <utility>

#include "fabric_planner/belief_filter.hpp"
#include "fabric_planner/random.hpp"

namespace fabric::planner {
namespace {

constexpr double NEGLIGIBLE = 1e-6;     // weight of what is left of an episode
constexpr int MOST_STEPS = 10000;       // of an episode nobody limited
constexpr double EXACT_ENOUGH = 1e-12;  // of a belief that everything has ended

double ownTime() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// The index at which the running sum of `probability` passes u; the last possible one at the end.
template <class Probability>
int draw(int count, double u, const Probability& probability) {
  int last = 0;
  for (int i = 0; i < count; ++i) {
    const double p = probability(i);
    if (p <= 0.0) continue;
    last = i;
    u -= p;
    if (u < 0.0) break;
  }
  return last;
}

/// One run of a policy, step by step.
class Episode {
 public:
  Episode(const std::shared_ptr<const Pomdp>& model, const BeliefPolicy& policy, const Random& luck)
      : m_(*model), policy_(policy), luck_(luck), filter_(model) {
    Random start = luck_.child(0);
    state_ = draw(m_.numStates(), start.uniform(), [&](int s) { return m_.initialBelief()(s); });
    if (policy_.reset) policy_.reset();
  }

  [[nodiscard]] int state() const { return state_; }
  [[nodiscard]] const Eigen::VectorXd& belief() const { return filter_.belief(); }
  [[nodiscard]] bool ended() const { return m_.terminal()[static_cast<size_t>(state_)]; }
  /// True when the policy, too, can know that there is nothing left to come.
  [[nodiscard]] bool knownToHaveEnded() const {
    if (!ended()) return false;
    double sum = 0.0;
    for (int s = 0; s < m_.numStates(); ++s) {
      sum += m_.terminal()[static_cast<size_t>(s)] ? belief()(s) : 0.0;
    }
    return sum >= 1.0 - EXACT_ENOUGH;
  }

  int decide() const {
    const int action = policy_.decide(belief());
    m_.checkAction(action);
    return action;
  }
  /// Draws what follows. @return the observation.
  int step(int action) {
    Random random = luck_.child(++steps_);
    const SparseRows& T = m_.T(action);
    const double u = random.uniform();
    SparseRows::InnerIterator it(T, state_);
    int next = static_cast<int>(it.col());
    for (double left = u; it; ++it) {
      next = static_cast<int>(it.col());
      left -= it.value();
      if (left < 0.0) break;
    }
    state_ = next;
    return draw(m_.numObservations(), random.uniform(),
                [&](int o) { return m_.O(action).coeff(state_, o); });
  }
  void advance(int action, int observation) {
    filter_.update(action, observation);
    if (policy_.advance) policy_.advance(action, observation);
  }

 private:
  const Pomdp& m_;
  const BeliefPolicy& policy_;
  Random luck_;
  BeliefFilter filter_;
  int state_ = 0;
  std::uint64_t steps_ = 0;
};

/// A shared pointer that owns nothing: the model outlives the call.
std::shared_ptr<const Pomdp> borrowed(const Pomdp& model) {
  return {std::shared_ptr<const Pomdp>(), &model};
}

/// V(b) - Q(b, a), with V the largest of the vectors and Q its backup.
double regret(const Pomdp& m, const AlphaVectors& V, const Eigen::VectorXd& b, int action) {
  const Eigen::VectorXd predicted = m.T(action).transpose() * b;
  double future = 0.0;
  for (int o = 0; o < m.numObservations(); ++o) {
    const Eigen::VectorXd joint = m.O(action).col(o).cwiseProduct(predicted);
    if (joint.sum() > 0.0) future += (V.vectors * joint).maxCoeff();
  }
  return (V.vectors * b).maxCoeff() - m.R().row(action).dot(b) - m.discount() * future;
}

struct Mean {
  std::vector<double> values;
  [[nodiscard]] double mean() const {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  }
  [[nodiscard]] double error() const {
    const double middle = mean();
    double squares = 0.0;
    for (const double value : values) squares += (value - middle) * (value - middle);
    const auto n = static_cast<double>(values.size());
    return std::sqrt(squares / (n - 1.0) / n);
  }
};

void check(const Pomdp& model, const AlphaVectors& reference, const EvaluationOptions& options) {
  const auto refuse = [&](const std::string& what) {
    throw ModelError(model.name() + ": " + what);
  };
  if (options.episodes < 2) {
    refuse("episodes is " + std::to_string(options.episodes) + ", expected at least 2");
  }
  if (options.steps < 0) refuse("steps is " + std::to_string(options.steps) + ", below 0");
  if (reference.vectors.rows() == 0 || reference.vectors.cols() == model.numStates()) return;
  refuse("the reference has " + std::to_string(reference.vectors.cols()) + " columns for " +
         std::to_string(model.numStates()) + " states");
}

int stepsOf(const Pomdp& model, const EvaluationOptions& options) {
  if (options.steps > 0) return options.steps;
  if (model.discount() >= 1.0) return MOST_STEPS;
  return std::min(MOST_STEPS,
                  static_cast<int>(std::ceil(std::log(NEGLIGIBLE) / std::log(model.discount()))));
}

}  // namespace

BeliefPolicy policyOf(OnlinePlanner& planner) {
  return {[&planner](const Eigen::VectorXd& belief) { return planner.decide(belief).action; },
          [&planner](int action, int observation) { planner.advance(action, observation); },
          [&planner] { planner.reset(); }};
}

BeliefPolicy policyOf(const Pomdp& model, AlphaVectors vectors) {
  const auto act = [&model, vectors = std::move(vectors)](const Eigen::VectorXd& belief) {
    int best = -1;
    double value = 0.0;
    for (Eigen::Index k = 0; k < vectors.vectors.rows(); ++k) {
      const int action = vectors.actions[static_cast<size_t>(k)];
      const double v = vectors.vectors.row(k).dot(belief);
      if ((best >= 0 && v <= value) || !model.isAllowed(action, belief)) continue;
      best = action;
      value = v;
    }
    if (best < 0) throw ModelError(model.name() + ": no vector has an action allowed at a belief");
    return best;
  };
  return {act, nullptr, nullptr};
}

std::vector<SimulatedStep> simulate(const Pomdp& model, const BeliefPolicy& policy, int steps,
                                    std::uint64_t seed) {
  std::vector<SimulatedStep> trace;
  Episode episode(borrowed(model), policy, Random(seed));
  for (int t = 0; t < steps && !episode.ended(); ++t) {
    const int action = episode.decide();
    const int state = episode.state();
    SimulatedStep step{state, action, 0, model.R()(action, state), episode.belief()};
    step.observation = episode.step(action);
    episode.advance(action, step.observation);
    trace.push_back(std::move(step));
  }
  return trace;
}

Evaluation evaluate(const Pomdp& model, const BeliefPolicy& policy, const AlphaVectors& reference,
                    const EvaluationOptions& options) {
  check(model, reference, options);
  const bool with_reference = reference.vectors.rows() > 0;
  const int steps = stepsOf(model, options);
  const double before = with_reference ? reference.value(model.initialBelief())
                                       : std::numeric_limits<double>::quiet_NaN();
  Mean returns;
  Mean controlled;
  Mean times;
  for (int i = 0; i < options.episodes; ++i) {
    const Random luck = Random(options.seed).child(static_cast<std::uint64_t>(i));
    Episode episode(borrowed(model), policy, luck);
    double weight = 1.0;
    returns.values.push_back(0.0);
    controlled.values.push_back(before);
    for (int t = 0; t < steps && !episode.knownToHaveEnded(); ++t, weight *= model.discount()) {
      const double begin = ownTime();
      const int action = episode.decide();
      times.values.push_back(ownTime() - begin);
      returns.values.back() += weight * model.R()(action, episode.state());
      if (with_reference) {
        controlled.values.back() -= weight * regret(model, reference, episode.belief(), action);
      }
      episode.advance(action, episode.step(action));
    }
  }
  Evaluation result{returns.mean(),
                    returns.error(),
                    controlled.mean(),
                    controlled.error(),
                    static_cast<std::int64_t>(times.values.size()),
                    0.0,
                    0.0};
  if (times.values.empty()) return result;
  result.decision_time = times.mean();
  const auto middle = times.values.begin() + static_cast<std::ptrdiff_t>(times.values.size() / 2);
  std::nth_element(times.values.begin(), middle, times.values.end());
  result.median_decision_time = *middle;
  return result;
}

}  // namespace fabric::planner

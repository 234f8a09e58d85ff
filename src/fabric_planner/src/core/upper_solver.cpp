// SPDX-License-Identifier: BSD-3-Clause
#include "upper_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fabric_planner/random.hpp"

namespace fabric::planner {
namespace {

constexpr double INFINITE = std::numeric_limits<double>::infinity();
constexpr int MAX_DEPTH = 60;
constexpr double LEFT_ALONE = 0.6;    // share of the gap that a trial does not go after
constexpr double GROWTH = 1.3;        // points of a round, of those before
constexpr int FEWEST_NEW = 20;        // and beyond that
constexpr int TRIALS = 50;            // of a round at most
constexpr std::uint64_t SAMPLED = 4;  // every so many trials draw the observations
constexpr int SWEEPS = 100;           // between two rounds of programming
constexpr double SETTLED = 1e-6;      // relative change that ends them
constexpr double SAME_BELIEF = 1e-4;  // grid on which two beliefs count as one
constexpr double NEGLIGIBLE = 1e-12;  // probability of an observation that is not followed

std::uint64_t keyOf(const SparseBelief& belief) {
  std::uint64_t key = 0;
  for (int i = 0; i < belief.size(); ++i) {
    const auto cell = static_cast<std::uint64_t>(
        std::llround(belief.value[static_cast<size_t>(i)] / SAME_BELIEF));
    key = mixBits(
        key ^
        mixBits((static_cast<std::uint64_t>(belief.index[static_cast<size_t>(i)]) << 32U) + cell));
  }
  return key;
}

}  // namespace

UpperSolver::UpperSolver(const SolverModel& model, AlphaVectors base, std::uint64_t seed)
    : m_(model),
      base_(std::move(base)),
      base_set_(model.states()),
      table_(model.states()),
      random_(seed) {
  for (Eigen::Index k = 0; k < base_.vectors.rows(); ++k) {
    const Eigen::VectorXd vector = base_.vectors.row(k).transpose();
    base_set_.add(vector.data(), base_.actions[static_cast<size_t>(k)]);
  }
  for (int s = 0; s < m_.states(); ++s) {
    table_.setCorner(s, base_.vectors.col(s).maxCoeff());
    SparseBelief corner;
    corner.index = {s};
    corner.value = {1.0};
    addSite(std::move(corner));
  }
  const SparseBelief start(m_.pomdp().initialBelief());
  root_ = siteOf(start, base_set_.best(start).value, std::numeric_limits<int>::max());
}

double UpperSolver::value(int site) const {
  return site < m_.states() ? table_.corner(site) : table_.value(site - m_.states());
}

void UpperSolver::lower(int site, double v) {
  if (v >= value(site)) return;
  if (site < m_.states()) {
    table_.setCorner(site, v);
  } else {
    table_.setValue(site - m_.states(), v);
  }
}

int UpperSolver::addSite(SparseBelief belief) {
  Site site;
  site.choices.resize(static_cast<size_t>(m_.actions()));
  for (int a = 0; a < m_.actions(); ++a) {
    Choice& choice = site.choices[static_cast<size_t>(a)];
    choice.q = -INFINITE;
    if (!m_.isAllowed(belief, a)) continue;
    choice.reward = m_.reward(belief, a);
    choice.q = 0.0;
    for (int i = 0; i < belief.size(); ++i) {
      choice.q += belief.value[static_cast<size_t>(i)] *
                  base_.vectors(a, belief.index[static_cast<size_t>(i)]);
    }
  }
  site.belief = std::move(belief);
  sites_.push_back(std::move(site));
  sums_.push_back(0.0);
  return static_cast<int>(sites_.size()) - 1;
}

int UpperSolver::siteOf(const SparseBelief& belief, double v, int max_points) {
  if (belief.size() == 1) return belief.index.front();
  const std::uint64_t key = keyOf(belief);
  const auto [first, last] = known_.equal_range(key);
  for (auto it = first; it != last; ++it) {
    if (distance(sites_[static_cast<size_t>(it->second)].belief, belief) < 20 * SAME_BELIEF) {
      return it->second;
    }
  }
  if (table_.size() >= max_points) return -1;
  table_.add(belief, v);
  const int site = addSite(belief);
  known_.emplace(key, site);
  return site;
}

/// Finds the weights of every successor of an action.
void UpperSolver::solve(int site, int action) {
  const SparseBelief& belief = sites_[static_cast<size_t>(site)].belief;
  Choice& choice = sites_[static_cast<size_t>(site)].choices[static_cast<size_t>(action)];
  m_.successors(belief, action, outcomes_);
  work_ += m_.successorWork(belief.size());
  size_t entries = 0;
  for (int o = 0; o < m_.observations(); ++o) entries += static_cast<size_t>(outcomes_.size(o));
  choice.basis.resize(entries, -1);
  choice.upper.resize(static_cast<size_t>(m_.observations()));
  choice.reward = m_.reward(belief, action);
  int* basis = choice.basis.data();
  for (int o = 0; o < m_.observations(); ++o) {
    if (outcomes_.size(o) == 0) continue;
    interpolate(o, basis, choice);
    basis += outcomes_.size(o);
  }
  choice.future.clear();
  choice.q = choice.reward;
  for (const int to : touched_) {
    const double weight = sums_[static_cast<size_t>(to)];
    choice.future.push_back({to, weight});
    choice.q += weight * value(to);
    sums_[static_cast<size_t>(to)] = 0.0;
  }
  touched_.clear();
  choice.known = true;
}

/// One successor, by points or by the base, whichever says less.
void UpperSolver::interpolate(int o, int* basis, Choice& choice) {
  const int n = outcomes_.size(o);
  const double between =
      interpolator_.solve(table_, outcomes_.index(o), outcomes_.value(o), n, basis);
  const double plain = base_set_.best(outcomes_.index(o), outcomes_.value(o), n).value;
  choice.upper[static_cast<size_t>(o)] = std::min(plain, between);
  if (plain <= between) {
    choice.reward += m_.discount() * plain;
    return;
  }
  const auto give = [&](int to, double weight) {
    if (weight <= 0.0) return;
    if (sums_[static_cast<size_t>(to)] == 0.0) touched_.push_back(to);
    sums_[static_cast<size_t>(to)] += weight;
  };
  for (const auto& [point, weight] : interpolator_.weights()) {
    give(m_.states() + point, weight * m_.discount());
  }
  for (int i = 0; i < n; ++i) {
    give(outcomes_.index(o)[i], interpolator_.rest()[static_cast<size_t>(i)] * m_.discount());
  }
}

double UpperSolver::bestStored(Site& site) {
  double best = -INFINITE;
  for (Choice& choice : site.choices) {
    if (choice.known) {
      double future = 0.0;
      for (const auto& [to, weight] : choice.future) future += weight * value(to);
      choice.q = std::min(choice.q, choice.reward + future);
      work_ += static_cast<double>(choice.future.size());
    }
    best = std::max(best, choice.q);
  }
  return best;
}

int UpperSolver::backUp(int site) {
  bestStored(sites_[static_cast<size_t>(site)]);
  std::vector<bool> fresh(static_cast<size_t>(m_.actions()), false);
  for (;;) {
    auto& choices = sites_[static_cast<size_t>(site)].choices;
    const auto best = std::max_element(choices.begin(), choices.end(),
                                       [](const Choice& x, const Choice& y) { return x.q < y.q; });
    const int action = static_cast<int>(best - choices.begin());
    if (fresh[static_cast<size_t>(action)] || best->q == -INFINITE) {
      if (best->q > -INFINITE) lower(site, best->q);
      return action;
    }
    const double before = best->q;
    solve(site, action);
    best->q = std::min(before, best->q);
    fresh[static_cast<size_t>(action)] = true;
  }
}

int UpperSolver::bestKnown(int site) {
  Site& place = sites_[static_cast<size_t>(site)];
  bestStored(place);
  const auto best = std::max_element(place.choices.begin(), place.choices.end(),
                                     [](const Choice& x, const Choice& y) { return x.q < y.q; });
  return best->known ? static_cast<int>(best - place.choices.begin()) : backUp(site);
}

int UpperSolver::descend(int site, int action, const VectorSet& lower, double excess) {
  m_.successors(sites_[static_cast<size_t>(site)].belief, action, outcomes_);
  const Choice& choice = sites_[static_cast<size_t>(site)].choices[static_cast<size_t>(action)];
  std::vector<double> weighted(static_cast<size_t>(m_.observations()), 0.0);
  double sum = 0.0;
  for (int o = 0; o < m_.observations(); ++o) {
    const int n = outcomes_.size(o);
    if (n == 0) continue;
    const double probability = outcomes_.probability(o);
    if (probability < NEGLIGIBLE) continue;
    const double low = lower.best(outcomes_.index(o), outcomes_.value(o), n).value;
    work_ += static_cast<double>(n) * lower.size();
    const double gap = choice.upper[static_cast<size_t>(o)] - low - probability * excess;
    weighted[static_cast<size_t>(o)] = std::max(0.0, gap);
    sum += weighted[static_cast<size_t>(o)];
  }
  if (sum <= 0.0) return -1;
  // Always the largest gap would walk in circles where it does not fall.
  if (trials_ % SAMPLED != 0) {
    return static_cast<int>(std::max_element(weighted.begin(), weighted.end()) - weighted.begin());
  }
  double u = random_.uniform() * sum;
  int last = -1;
  for (int o = 0; o < m_.observations() && u >= 0.0; ++o) {
    if (weighted[static_cast<size_t>(o)] <= 0.0) continue;
    last = o;
    u -= weighted[static_cast<size_t>(o)];
  }
  return last;
}

void UpperSolver::trial(const VectorSet& lower, double excess, int max_points) {
  ++trials_;
  path_.clear();
  int site = root_;
  double left_alone =
      excess * (root() - lower.best(sites_[static_cast<size_t>(root_)].belief).value);
  while (site >= 0 && static_cast<int>(path_.size()) < MAX_DEPTH) {
    path_.push_back(site);
    const int action = bestKnown(site);
    left_alone /= m_.discount();
    const int o = descend(site, action, lower, left_alone);
    if (o < 0) break;
    const double bound = sites_[static_cast<size_t>(site)]
                             .choices[static_cast<size_t>(action)]
                             .upper[static_cast<size_t>(o)];
    const SparseBelief next = outcomes_.normalised(o);
    const double v = std::min(base_set_.best(next).value, bound / outcomes_.probability(o));
    site = siteOf(next, v, max_points);
  }
  for (size_t i = path_.size(); i-- > 0;) backUp(path_[i]);
}

std::vector<SparseBelief> UpperSolver::path() const {
  std::vector<SparseBelief> beliefs;
  for (const int site : path_) beliefs.push_back(sites_[static_cast<size_t>(site)].belief);
  return beliefs;
}

double UpperSolver::sweep(int sweeps, double tolerance) {
  double most = 0.0;
  for (int i = 0; i < sweeps; ++i) {
    most = 0.0;
    for (int site = static_cast<int>(sites_.size()); site-- > 0;) {
      const double best = bestStored(sites_[static_cast<size_t>(site)]);
      if (best == -INFINITE) continue;
      most = std::max(most, value(site) - best);
      lower(site, best);
    }
    if (most <= tolerance) break;
  }
  return most;
}

void UpperSolver::reoptimise(const std::function<bool()>& on) {
  for (int site = static_cast<int>(sites_.size()); site-- > 0 && on();) backUp(site);
}

bool UpperSolver::round(const VectorSet& lower, int max_points, const std::function<bool()>& on) {
  const double before = root();
  const int points = table_.size();
  const int enough = static_cast<int>(GROWTH * points) + FEWEST_NEW;
  for (int i = 0; i < TRIALS && table_.size() < enough && on(); ++i) {
    trial(lower, LEFT_ALONE, max_points);
  }
  const double tolerance = SETTLED * (1.0 + std::abs(root()));
  sweep(SWEEPS, tolerance);
  reoptimise(on);
  sweep(SWEEPS, tolerance);
  return table_.size() > points || root() < before;
}

PointUpperBound UpperSolver::bound(int query_points) const {
  Eigen::VectorXd corners(m_.states());
  for (int s = 0; s < m_.states(); ++s) corners(s) = table_.corner(s);
  Eigen::MatrixXd points(m_.states(), table_.size());
  for (int k = 0; k < table_.size(); ++k) points.col(k) = table_.belief(k).dense(m_.states());
  const Eigen::Map<const Eigen::VectorXd> values(table_.size() > 0 ? table_.values() : nullptr,
                                                 table_.size());
  return {base_, corners, points, values, query_points};
}

}  // namespace fabric::planner

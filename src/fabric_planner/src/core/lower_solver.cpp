// SPDX-License-Identifier: BSD-3-Clause
#include "lower_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "controller.hpp"
#include "solver_kernels.hpp"

namespace fabric::planner {
namespace {

constexpr double CLOSE_BELIEFS = 1e-2;  // L1 distance below which two beliefs count as one
constexpr double NO_GAIN = 1e-9;        // relative gain of looking ahead that is not worth a belief
constexpr int FIRST_IMPROVEMENTS = 4;   // of the beliefs of another policy
constexpr int IMPROVEMENTS = 2;         // of the beliefs of each later round
constexpr double LATE = 1e-3;           // discount at which an episode ends

/// Draws an observation; -1 when rounding leaves none.
int draw(const Outcomes& successors, int observations, double u) {
  int last = -1;
  for (int o = 0; o < observations; ++o) {
    if (successors.size(o) == 0) continue;
    last = o;
    u -= successors.probability(o);
    if (u < 0.0) break;
  }
  return last;
}

}  // namespace

LowerSolver::LowerSolver(const SolverModel& model, std::uint64_t seed)
    : m_(model), random_(seed), blind_(blindBound(model.pomdp())), vectors_(model.states()) {
  for (Eigen::Index k = 0; k < blind_.vectors.rows(); ++k) {
    const Eigen::VectorXd vector = blind_.vectors.row(k).transpose();
    vectors_.add(vector.data(), blind_.actions[static_cast<size_t>(k)]);
  }
  beliefs_.emplace_back(model.pomdp().initialBelief());
}

AlphaVectors LowerSolver::bound() const {
  AlphaVectors bound;
  bound.vectors = vectors_.matrix();
  for (int k = 0; k < vectors_.size(); ++k) bound.actions.push_back(vectors_.action(k));
  for (Eigen::Index k = 0; k < blind_.vectors.rows(); ++k) {
    const auto blind = blind_.vectors.row(k);
    const Eigen::MatrixXd excess = bound.vectors.rowwise() - blind;
    if ((excess.rowwise().minCoeff().array() >= 0.0).any()) continue;
    bound.vectors.conservativeResize(bound.vectors.rows() + 1, Eigen::NoChange);
    bound.vectors.bottomRows(1) = blind;
    bound.actions.push_back(blind_.actions[static_cast<size_t>(k)]);
  }
  return bound;
}

void LowerSolver::bestSuccessors(const VectorSet& set, const SparseBelief& belief, int action,
                                 std::vector<int>& next) {
  m_.successors(belief, action, outcomes_);
  next.resize(static_cast<size_t>(m_.observations()));
  const int anyhow = set.best(outcomes_.predicted()).vector;
  for (int o = 0; o < m_.observations(); ++o) {
    const int n = outcomes_.size(o);
    work_ += static_cast<double>(n) * set.size();
    next[static_cast<size_t>(o)] =
        n == 0 ? anyhow : set.best(outcomes_.index(o), outcomes_.value(o), n).vector;
  }
}

void LowerSolver::lookAhead(const SparseBelief& belief, LookAhead& best) {
  best.action = -1;
  best.value = -std::numeric_limits<double>::infinity();
  auto& next = trial_.next;
  next.resize(static_cast<size_t>(m_.observations()));
  for (int a = 0; a < m_.actions(); ++a) {
    if (!m_.isAllowed(belief, a)) continue;
    m_.successors(belief, a, outcomes_);
    work_ += m_.successorWork(belief.size());
    double future = 0.0;
    for (int o = 0; o < m_.observations(); ++o) {
      const int n = outcomes_.size(o);
      next[static_cast<size_t>(o)] = -1;
      if (n == 0) continue;
      work_ += static_cast<double>(n) * vectors_.size();
      const auto found = vectors_.best(outcomes_.index(o), outcomes_.value(o), n);
      next[static_cast<size_t>(o)] = found.vector;
      future += found.value;
    }
    const double value = m_.reward(belief, a) + m_.discount() * future;
    if (value <= best.value) continue;
    best.action = a;
    best.value = value;
    best.next.swap(next);
    next.resize(static_cast<size_t>(m_.observations()));
  }
  if (best.action < 0) return;
  const int anyhow = vectors_.best(belief).vector;
  for (int& to : best.next) to = to < 0 ? anyhow : to;
}

bool LowerSolver::isNear(const SparseBelief& belief) const {
  return std::any_of(beliefs_.begin(), beliefs_.end(), [&](const SparseBelief& known) {
    return distance(known, belief) < CLOSE_BELIEFS;
  });
}

bool LowerSolver::addBelief(const SparseBelief& belief) {
  if (isNear(belief)) return false;
  beliefs_.push_back(belief);
  return true;
}

bool LowerSolver::hasEnded(const SparseBelief& belief) const {
  return std::all_of(belief.index.begin(), belief.index.end(),
                     [&](int s) { return m_.pomdp().terminal()[static_cast<size_t>(s)]; });
}

bool LowerSolver::moveOn(int action, Random& random, SparseBelief& belief) {
  m_.successors(belief, action, outcomes_);
  work_ += m_.successorWork(belief.size());
  const int o = draw(outcomes_, m_.observations(), random.uniform());
  if (o >= 0) belief = outcomes_.normalised(o);
  return o >= 0;
}

void LowerSolver::simulate(int depth, Random random, std::vector<Met>& met) {
  SparseBelief belief = beliefs_.front();
  LookAhead choice;
  double weight = 1.0;
  for (int step = 0; step < depth && weight > LATE && !hasEnded(belief); ++step) {
    lookAhead(belief, choice);
    if (choice.action < 0) return;
    const double gain = choice.value - vectors_.best(belief).value;
    if (gain > NO_GAIN * (1.0 + std::abs(choice.value))) met.push_back({belief, weight * gain});
    if (!moveOn(choice.action, random, belief)) return;
    weight *= m_.discount();
  }
}

int LowerSolver::follow(const AlphaVectors& policy, int episodes, int depth, int count) {
  VectorSet vectors(m_.states());
  for (Eigen::Index k = 0; k < policy.vectors.rows(); ++k) {
    const Eigen::VectorXd vector = policy.vectors.row(k).transpose();
    vectors.add(vector.data(), policy.actions[static_cast<size_t>(k)]);
  }
  const Random round = random_.child(rounds_++);
  int added = 0;
  for (int i = 0; i < episodes; ++i) {
    Random random = round.child(static_cast<std::uint64_t>(i));
    SparseBelief belief = beliefs_.front();
    for (int step = 0; step < depth && !hasEnded(belief); ++step) {
      const int action = vectors.action(vectors.best(belief).vector);
      if (!m_.isAllowed(belief, action) || !moveOn(action, random, belief)) break;
      if (addBelief(belief) && ++added == count) return added;
    }
  }
  return added;
}

int LowerSolver::gather(int episodes, int depth, int count) {
  std::vector<Met> met;
  const Random round = random_.child(rounds_++);
  for (int i = 0; i < episodes; ++i) {
    simulate(depth, round.child(static_cast<std::uint64_t>(i)), met);
  }
  std::stable_sort(met.begin(), met.end(),
                   [](const Met& left, const Met& right) { return left.gain > right.gain; });
  int added = 0;
  for (const Met& candidate : met) {
    if (added == count) break;
    if (addBelief(candidate.belief)) ++added;
  }
  return added;
}

bool LowerSolver::step(const PointBasedOptions& options) {
  const auto room = [&] { return options.beliefs - static_cast<int>(beliefs_.size()); };
  int added = 0;
  int improvements = IMPROVEMENTS;
  if (!begun_) {
    begun_ = true;
    added = follow(fastInformedBound(m_.pomdp()), options.episodes, options.depth,
                   std::min(options.first_beliefs, room()));
    improvements = FIRST_IMPROVEMENTS;
  } else if (room() > 0) {
    const int share = static_cast<int>(beliefs_.size()) / 5;
    added = gather(options.episodes, options.depth,
                   std::min(std::max(options.new_beliefs, share), room()));
  }
  double gain = 0.0;
  for (int i = 0; i < improvements; ++i) gain = std::max(gain, improve());
  return added > 0 || gain > options.tolerance;
}

void LowerSolver::backUp(const VectorSet& set, const LookAhead& choice, double* alpha) {
  std::vector<const double*> next;
  for (const int to : choice.next) next.push_back(set.row(to));
  Eigen::VectorXd scratch(m_.width());
  m_.backProject(choice.action, next.data(), scratch.data(), alpha);
  work_ += m_.projectionWork();
  const Pomdp& pomdp = m_.pomdp();
  for (int s = 0; s < m_.states(); ++s) {
    const bool forbidden = pomdp.allowed().size() > 0 && !pomdp.allowed()(choice.action, s);
    alpha[s] = forbidden ? FORBIDDEN : std::max(FORBIDDEN, alpha[s] + pomdp.R()(choice.action, s));
  }
}

LowerSolver::Backups LowerSolver::backUpAll() {
  Backups nodes{{}, VectorSet(m_.states())};
  Eigen::VectorXd alpha = Eigen::VectorXd::Zero(m_.width());
  LookAhead choice;
  for (const SparseBelief& belief : beliefs_) {
    lookAhead(belief, choice);
    if (choice.action < 0) continue;
    backUp(vectors_, choice, alpha.data());
    nodes.places.push_back(&belief);
    nodes.vectors.add(alpha.data(), choice.action);
  }
  return nodes;
}

/// Lets the nodes follow one another and the present vectors, which join the set.
void LowerSolver::evaluate(VectorSet& set, const std::vector<const SparseBelief*>& places) {
  const int nodes = set.size();
  for (int k = 0; k < vectors_.size(); ++k) set.add(vectors_.row(k), vectors_.action(k));
  Controller controller(m_);
  Eigen::MatrixXd start(m_.width(), nodes);
  std::vector<int> next;
  for (int i = 0; i < nodes; ++i) {
    bestSuccessors(set, *places[static_cast<size_t>(i)], set.action(i), next);
    controller.add(set.action(i), next);
    start.col(i) = Eigen::Map<const Eigen::VectorXd>(set.row(i), m_.width());
  }
  std::vector<const double*> known;
  for (int k = nodes; k < set.size(); ++k) known.push_back(set.row(k));
  const Eigen::MatrixXd values = controller.evaluate(known, std::move(start), work_);
  for (int i = 0; i < nodes; ++i) set.set(i, values.col(i).data());
}

double LowerSolver::improve() {
  Backups nodes = backUpAll();
  if (nodes.places.empty()) return 0.0;
  std::vector<double> before;
  for (const auto* place : nodes.places) before.push_back(vectors_.best(*place).value);
  evaluate(nodes.vectors, nodes.places);
  vectors_ = std::move(nodes.vectors);
  prune();
  double gain = 0.0;
  for (size_t i = 0; i < before.size(); ++i) {
    gain = std::max(gain, vectors_.best(*nodes.places[i]).value - before[i]);
  }
  return gain;
}

void LowerSolver::prune() {
  std::vector<int> kept;
  for (const SparseBelief& belief : beliefs_) {
    work_ += static_cast<double>(belief.size()) * vectors_.size();
    kept.push_back(vectors_.best(belief).vector);
  }
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  vectors_.keep(kept);
}

}  // namespace fabric::planner

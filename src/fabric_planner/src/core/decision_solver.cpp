// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/decision_solver.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "fabric_planner/despot.hpp"
#include "fabric_planner/particle_belief.hpp"
#include "fabric_planner/pomcp.hpp"
#include "fabric_planner/tabular_model.hpp"

namespace fabric::planner {
namespace {

constexpr std::array<std::pair<SolverKind, const char*>, 4> NAMES = {{
    {SolverKind::SEARCH, "search"},
    {SolverKind::OFFLINE, "offline"},
    {SolverKind::DESPOT, "despot"},
    {SolverKind::POMCP, "pomcp"},
}};

AlphaVectors joined(const AlphaVectors& one, const AlphaVectors& other) {
  AlphaVectors all;
  all.vectors.resize(one.vectors.rows() + other.vectors.rows(), one.vectors.cols());
  all.vectors << one.vectors, other.vectors;
  all.actions = one.actions;
  all.actions.insert(all.actions.end(), other.actions.begin(), other.actions.end());
  return all;
}

void checkPolicy(const Pomdp& model, const AlphaVectors& policy) {
  if (policy.vectors.rows() > 0 && policy.vectors.cols() == model.numStates()) return;
  throw ModelError(model.name() + ": the policy is of shape (" +
                   std::to_string(policy.vectors.rows()) + ", " +
                   std::to_string(policy.vectors.cols()) + "), expected vectors of " +
                   std::to_string(model.numStates()));
}

std::unique_ptr<OnlinePlanner> makePlanner(const std::shared_ptr<const Pomdp>& model,
                                           const PlannerOptions& options,
                                           const std::optional<AlphaVectors>& policy) {
  if (!policy) return std::make_unique<OnlinePlanner>(model, options);
  checkPolicy(*model, *policy);
  return std::make_unique<OnlinePlanner>(model, options,
                                         joined(preparedLowerBound(*model, options), *policy),
                                         preparedUpperBound(*model, options));
}

class SearchSolver final : public DecisionSolver {
 public:
  explicit SearchSolver(std::unique_ptr<OnlinePlanner> planner) : planner_(std::move(planner)) {}
  Decision decide(const Eigen::VectorXd& belief) override { return planner_->decide(belief); }
  void advance(int action, int observation) override { planner_->advance(action, observation); }
  void reset() override { planner_->reset(); }

 private:
  std::unique_ptr<OnlinePlanner> planner_;
};

/// A planner that may not search has nothing but its offline vectors.
class OfflineSolver final : public DecisionSolver {
 public:
  OfflineSolver(const std::shared_ptr<const Pomdp>& model, PlannerOptions options,
                const std::optional<AlphaVectors>& policy) {
    options.max_nodes = 0;
    if (policy) checkPolicy(*model, *policy);
    planner_ = std::make_unique<OnlinePlanner>(
        model, options, policy ? *policy : preparedLowerBound(*model, options),
        preparedUpperBound(*model, options));
  }
  Decision decide(const Eigen::VectorXd& belief) override {
    Decision decision = planner_->decide(belief);
    decision.fallback_used = false;  // the policy is what was asked for
    return decision;
  }
  void advance(int /*action*/, int /*observation*/) override {}
  void reset() override { planner_->reset(); }

 private:
  std::unique_ptr<OnlinePlanner> planner_;
};

/// A belief that is set, not updated.
class GivenBelief final : public Belief<TabularModel::State> {
 public:
  using Belief<TabularModel::State>::sample;

  void set(const Eigen::VectorXd& belief) { belief_ = belief; }
  void reset(std::uint64_t /*seed*/) override {}
  UpdateStatus update(int /*action*/, Observation /*observation*/) override {
    return UpdateStatus::OK;
  }
  void sample(Random& random, int count, TabularModel::State* out) const override {
    systematicDraw(random, belief_.data(), static_cast<int>(belief_.size()), belief_.sum(), count,
                   [&](int state) { *out++ = state; });
    shuffle(random, out - count, count);
  }
  [[nodiscard]] std::uint64_t recoveries() const override { return 0; }

 private:
  Eigen::VectorXd belief_;
};

class DespotSolver final : public DecisionSolver {
 public:
  DespotSolver(const std::shared_ptr<const Pomdp>& model, const DespotOptions& options)
      : model_(model), planner_(model_, options) {}
  Decision decide(const Eigen::VectorXd& belief) override {
    belief_.set(model_.pomdp().checkedBelief(belief));
    return planner_.decide(belief_);
  }
  void advance(int /*action*/, int /*observation*/) override {}
  void reset() override { planner_.reset(planner_.options().seed); }

 private:
  TabularModel model_;
  Despot<TabularModel> planner_;
  GivenBelief belief_;
};

class PomcpSolver final : public DecisionSolver {
 public:
  PomcpSolver(const std::shared_ptr<const Pomdp>& model, const PomcpOptions& options)
      : model_(model), seed_(options.seed), planner_(model_, options) {}
  Decision decide(const Eigen::VectorXd& belief) override {
    belief_.set(model_.pomdp().checkedBelief(belief));
    return planner_.decide(belief_);
  }
  void advance(int action, int observation) override {
    planner_.advance(action, static_cast<Observation>(observation));
  }
  void reset() override { planner_.reset(seed_); }

 private:
  TabularModel model_;
  std::uint64_t seed_;
  Pomcp<TabularModel> planner_;
  GivenBelief belief_;
};

std::unique_ptr<DecisionSolver> makeDespot(const std::shared_ptr<const Pomdp>& model,
                                           const PlannerOptions& options, std::uint64_t seed) {
  DespotOptions despot;
  despot.deadline = options.deadline;
  despot.gap = options.gap;
  despot.max_nodes = options.max_nodes;
  despot.seed = seed;
  return std::make_unique<DespotSolver>(model, despot);
}

std::unique_ptr<DecisionSolver> makePomcp(const std::shared_ptr<const Pomdp>& model,
                                          const PlannerOptions& options, std::uint64_t seed) {
  PomcpOptions pomcp;
  pomcp.deadline = options.deadline;
  pomcp.max_simulations = options.max_nodes;
  pomcp.seed = seed;
  return std::make_unique<PomcpSolver>(model, pomcp);
}

}  // namespace

SolverKind solverFromName(const std::string& name) {
  for (const auto& [kind, known] : NAMES) {
    if (name == known) return kind;
  }
  throw ModelError("solver '" + name + "' is unknown (known: search, offline, despot, pomcp)");
}

std::string solverName(SolverKind kind) {
  const auto found = std::find_if(NAMES.begin(), NAMES.end(),
                                  [kind](const auto& entry) { return entry.first == kind; });
  return found->second;
}

std::unique_ptr<DecisionSolver> makeSolver(SolverKind kind,
                                           const std::shared_ptr<const Pomdp>& model,
                                           const PlannerOptions& options,
                                           const std::optional<AlphaVectors>& policy,
                                           std::uint64_t seed) {
  switch (kind) {
    case SolverKind::OFFLINE:
      return std::make_unique<OfflineSolver>(model, options, policy);
    case SolverKind::DESPOT:
      return makeDespot(model, options, seed);
    case SolverKind::POMCP:
      return makePomcp(model, options, seed);
    case SolverKind::SEARCH:
      break;
  }
  return std::make_unique<SearchSolver>(makePlanner(model, options, policy));
}

}  // namespace fabric::planner

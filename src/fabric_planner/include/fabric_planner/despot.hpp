// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "fabric_planner/default_policy.hpp"
#include "fabric_planner/despot_tree.hpp"
#include "fabric_planner/observation_groups.hpp"
#include "fabric_planner/particle_belief.hpp"
#include "fabric_planner/search_clock.hpp"

namespace fabric::planner {

struct DespotOptions {
  double deadline = 0.1;          ///< s a decision may take, >= 0
  double gap = 1e-6;              ///< difference of the bounds that is good enough, >= 0
  int max_nodes = 1000000;        ///< histories one decision may open, >= 0
  int scenarios = 500;            ///< K, >= 1
  int depth = 90;                 ///< D: steps looked ahead, >= 1
  double regularisation = 0.01;   ///< lambda: price of a policy node, in units of reward, >= 0
  double target = 0.95;           ///< xi: a branch is done at this share of the root's gap, [0, 1)
  std::size_t memory = 32 << 20;  ///< bytes for the tree, taken once
  std::uint64_t seed = 0;         ///< of all scenarios of all decisions
  bool cpu_time = false;          ///< deadline in CPU time of the thread: for measurements
};

/// @throw ModelError naming the option that is out of range.
DespotOptions checked(DespotOptions options);

/// Anytime planning for generative models of any size: DESPOT (Ye, Somani, Hsu & Lee, JAIR 2017).
///
/// K scenarios are drawn from the belief; a scenario is a state and all random numbers to come. A
/// tree of histories holds the scenarios that lead to each. Between the value of the model's
/// default policy and a relaxation, search opens the histories that matter most for the gap at the
/// root. The policy it looks for maximises the mean value over the scenarios minus lambda for each
/// of its nodes, which keeps it from learning the scenarios by heart.
///
/// An action of a history is simulated only when its upper bound is the best there.
///
/// **The bounds are those of the K scenarios, not of the model: they are no certificates.** The
/// mean over scenarios errs by chance; more scenarios err less.
///
/// All memory is taken by the constructor. A decision ends when the bounds meet, when the deadline
/// is near, or when max_nodes or the memory is used up (both told as NODES). The same seed and the
/// same calls give the same decisions unless one ended by DEADLINE. One object serves one thread.
template <class Model>
class Despot {
 public:
  using State = typename Model::State;

  /// @param model outlives the planner. @throw ModelError when model or options are out of range.
  explicit Despot(const Model& model, DespotOptions options = {})
      : model_(model),
        options_(checked(options)),
        tree_(options.memory,
              {options.regularisation, options.target, options.scenarios, options.depth}),
        policy_(model, options.scenarios, options.depth),
        groups_(options.scenarios) {
    generative::check(model);
    const auto size = static_cast<std::size_t>(options.scenarios);
    next_states_.resize(size);
    next_scenarios_.resize(size);
    observations_.resize(size);
    bounds_.resize(static_cast<std::size_t>(model.numActions()));
    reset(options.seed);
  }

  /// Starts the random numbers again.
  void reset(std::uint64_t seed) { random_ = Random(seed); }
  [[nodiscard]] const DespotOptions& options() const { return options_; }
  /// The tree of the last decision.
  [[nodiscard]] const DespotTree& tree() const { return tree_; }

  Decision decide(const Belief<State>& belief) {
    SearchClock clock(options_.deadline, options_.cpu_time);
    Decision decision;
    streams_ = ScenarioStreams(random_.bits());
    opened_ = 0;
    DespotNode* root = tree_.clear();
    if (root == nullptr || !plant(belief, *root, clock)) {
      fallBack(belief, clock, decision);
    } else {
      decision.ended_by = search(clock, decision.trials);
      tree_.choose(decision);
    }
    decision.nodes = opened_;
    decision.planning_time = clock.elapsed();
    decision.deadline_missed = decision.planning_time > options_.deadline;
    return decision;
  }

 private:
  enum class Ended { DONE, STUCK, FULL, TIME };

  void fallBack(const Belief<State>& belief, const SearchClock& clock, Decision& decision) {
    belief.sample(random_, 1, next_states_.data());
    const RewardRange range = model_.rewardRange();
    decision.action = policy_.action(next_states_.data(), 1);
    decision.lower_bound = decision.value = range.low / (1.0 - model_.discount());
    decision.upper_bound = range.high / (1.0 - model_.discount());
    decision.fallback_used = true;
    decision.ended_by = clock.expired() ? EndedBy::DEADLINE : EndedBy::NODES;
  }

  /// Draws the scenarios and bounds the root. False when time or memory are used up.
  bool plant(const Belief<State>& belief, DespotNode& root, SearchClock& clock) {
    auto* states = tree_.arena().template take<State>(options_.scenarios);
    auto* scenarios = tree_.arena().template take<std::uint32_t>(options_.scenarios);
    if (states == nullptr || scenarios == nullptr) return false;
    belief.sample(random_, options_.scenarios, states);
    for (int i = 0; i < options_.scenarios; ++i) scenarios[i] = static_cast<std::uint32_t>(i);
    root.states = states;
    root.scenarios = scenarios;
    root.count = options_.scenarios;
    return policy_.prepare(states, scenarios, root.count, streams_, clock) && bound(root, clock);
  }

  EndedBy search(SearchClock& clock, int& trials) {
    const DespotNode& root = tree_.root();
    while (root.upper - root.lower > options_.gap) {
      const Ended ended = explore(clock);
      if (ended == Ended::TIME) return EndedBy::DEADLINE;
      if (ended == Ended::FULL) return EndedBy::NODES;
      ++trials;
      if (ended == Ended::STUCK) break;
    }
    return EndedBy::GAP;
  }

  /// One trial: from the root down to where nothing more is worth knowing, then backs up.
  Ended explore(SearchClock& clock) {
    DespotNode* node = const_cast<DespotNode*>(&tree_.root());
    Ended ended = Ended::STUCK;
    while (node->depth < options_.depth && node->upper > node->lower) {
      const Ended opened = descend(node, clock);
      if (opened == Ended::DONE) ended = Ended::DONE;
      if (opened == Ended::FULL || opened == Ended::TIME) {
        DespotTree::backUp(node);
        return opened;
      }
      DespotNode* next =
          node->upper > node->lower ? tree_.uncertain(DespotTree::promising(*node)) : nullptr;
      if (next == nullptr) break;
      node = next;
      if (node->edges == nullptr && tree_.blocked(*node)) {
        DespotTree::close(*node);
        ended = Ended::DONE;
        break;
      }
    }
    DespotTree::backUp(node);
    return ended;
  }

  /// Simulates actions of a node until the most promising one is known. STUCK: it was already.
  Ended descend(DespotNode* node, SearchClock& clock) {
    if (node->edges == nullptr) {
      if (opened_ >= options_.max_nodes) return Ended::FULL;
      if (!open(*node)) return Ended::FULL;
      ++opened_;
    }
    Ended ended = Ended::STUCK;
    while (node->upper > node->lower) {
      DespotEdge& edge = DespotTree::promising(*node);
      if (edge.simulated) return ended;
      const std::size_t mark = tree_.arena().mark();
      if (!simulate(*node, edge, clock)) {
        tree_.arena().release(mark);
        return clock.expired() ? Ended::TIME : Ended::FULL;
      }
      DespotTree::refresh(*node);
      ended = Ended::DONE;
    }
    return ended;
  }

  [[nodiscard]] double share(const DespotNode& node) const {
    return policy_.discount(node.depth) / options_.scenarios;
  }
  [[nodiscard]] static const State* states(const DespotNode& node) {
    return static_cast<const State*>(node.states);
  }

  /// Fills bounds_ (A,) with upper bounds summed over the node's states. False: the model bounds
  /// states only.
  bool boundActions(const DespotNode& node) {
    if constexpr (generative::HAS_ADD_UPPER_BOUNDS<Model>) {
      std::fill(bounds_.begin(), bounds_.end(), 0.0);
      for (int i = 0; i < node.count; ++i) {
        model_.addUpperBounds(states(node)[i], bounds_.data());
      }
      return true;
    } else {
      return false;
    }
  }

  double upperBound(const DespotNode& node) {
    if (boundActions(node)) return *std::max_element(bounds_.begin(), bounds_.end());
    double sum = 0.0;
    for (int i = 0; i < node.count; ++i) {
      sum += generative::upperBound(model_, states(node)[i]);
    }
    return sum;
  }

  /// First bounds of a node that has its scenarios. False when time was up.
  bool bound(DespotNode& node, SearchClock& clock) {
    const DefaultValue value =
        policy_.value(states(node), node.scenarios, node.count, node.depth, streams_, clock);
    if (!value.finished) return false;
    node.default_action = value.action;
    tree_.bound(node, share(node) * value.sum, share(node) * upperBound(node));
    return true;
  }

  /// Lists the actions of a node. False when there is no room.
  bool open(DespotNode& node) {
    const int actions = model_.numActions();
    const bool by_action = boundActions(node);
    auto* edges = tree_.arena().template take<DespotEdge>(static_cast<std::size_t>(actions));
    if (edges == nullptr) return false;
    node.edges = edges;
    node.num_edges = 0;
    for (int a = 0; a < actions; ++a) {
      if (!generative::legalForAll(model_, states(node), node.count, a)) continue;
      const double upper =
          by_action ? share(node) * bounds_[static_cast<std::size_t>(a)] : node.plain_upper;
      DespotEdge& edge = edges[node.num_edges++];
      edge = DespotEdge{};
      edge.lower = -std::numeric_limits<double>::infinity();
      edge.plain_upper = upper;
      edge.upper = upper - options_.regularisation;
      edge.node = &node;
      edge.action = a;
    }
    return true;
  }

  /// Carries an action out in all scenarios of its node and bounds what comes of it. False, with
  /// the edge as it was, when time or memory are used up.
  bool simulate(const DespotNode& node, DespotEdge& edge, SearchClock& clock) {
    double reward = 0.0;
    const int left = step(node, edge.action, clock, reward);
    if (left < 0) return false;
    const int parts = groups_.group(observations_.data(), left);
    auto* children = tree_.arena().template take<DespotNode>(static_cast<std::size_t>(parts));
    auto* next = tree_.arena().template take<State>(static_cast<std::size_t>(left));
    auto* scenarios = tree_.arena().template take<std::uint32_t>(static_cast<std::size_t>(left));
    if (children == nullptr || next == nullptr || scenarios == nullptr) return false;
    for (int i = 0; i < left; ++i) {
      const auto from = static_cast<std::size_t>(groups_.order()[i]);
      next[i] = next_states_[from];
      scenarios[i] = next_scenarios_[from];
    }
    for (int g = 0, begin = 0; g < parts; begin += groups_.size(g), ++g) {
      children[g] = DespotNode{};
      children[g].parent = &edge;
      children[g].states = next + begin;
      children[g].scenarios = scenarios + begin;
      children[g].count = groups_.size(g);
      children[g].depth = node.depth + 1;
      if (!bound(children[g], clock)) return false;
    }
    edge.children = children;
    edge.num_children = parts;
    edge.reward = share(node) * reward - options_.regularisation;
    edge.plain_upper = share(node) * reward;
    DespotTree::sum(edge);
    return true;
  }

  /// Steps every scenario of a node into next_states_ and so on. @return how many go on; -1 when
  /// time was up.
  int step(const DespotNode& node, int action, SearchClock& clock, double& reward) {
    int left = 0;
    for (int i = 0; i < node.count; ++i) {
      if (!clock.spend(1)) return -1;
      State state = states(node)[i];
      const Step step = model_.step(state, action, streams_.at(node.scenarios[i], node.depth));
      reward += step.reward;
      if (step.terminal) continue;
      const auto to = static_cast<std::size_t>(left++);
      next_states_[to] = state;
      next_scenarios_[to] = node.scenarios[i];
      observations_[to] = step.observation;
    }
    return left;
  }

  const Model& model_;
  DespotOptions options_;
  DespotTree tree_;
  DefaultPolicy<Model> policy_;
  ObservationGroups groups_;
  ScenarioStreams streams_;
  Random random_{0};
  int opened_ = 0;
  std::vector<State> next_states_;  // of the action being simulated, before they are sorted
  std::vector<std::uint32_t> next_scenarios_;
  std::vector<Observation> observations_;
  std::vector<double> bounds_;  // (A,)
};

}  // namespace fabric::planner

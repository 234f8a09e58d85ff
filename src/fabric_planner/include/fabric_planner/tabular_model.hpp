// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/generative.hpp"
#include "fabric_planner/particle_belief.hpp"
#include "fabric_planner/pomdp.hpp"

namespace fabric::planner {

/// A tabular POMDP as a generative model. Observations are the indices of the table's.
///
/// A step draws from the rows of T and O in constant time (alias method, Walker 1977). Reaching a
/// terminal state of the table ends the episode. The belief is exact.
class TabularModel {
 public:
  using State = std::int32_t;

  /// Bounded by fastInformedBound() and blindBound(). @throw ModelError when the discount is 1.
  explicit TabularModel(std::shared_ptr<const Pomdp> pomdp);
  /// With bounds from elsewhere. @param upper one vector for each action, in their order, each at
  /// least the value of its action. @param lower vectors of policies that can be run.
  /// @throw ModelError when there is not one upper vector an action, or no lower vector.
  TabularModel(std::shared_ptr<const Pomdp> pomdp, const AlphaVectors& upper,
               const AlphaVectors& lower);

  [[nodiscard]] const Pomdp& pomdp() const { return *pomdp_; }
  [[nodiscard]] int numActions() const { return pomdp_->numActions(); }
  [[nodiscard]] double discount() const { return pomdp_->discount(); }
  [[nodiscard]] std::vector<std::string> actionNames() const { return pomdp_->actions(); }
  [[nodiscard]] RewardRange rewardRange() const { return range_; }
  State initialState(Random& random) const { return start_.draw(0, random.uniform()); }
  Step step(State& state, int action, double u) const {
    const auto a = static_cast<std::size_t>(action);
    const double reward = rewards_[a * static_cast<std::size_t>(states_) + state];
    state = transitions_[a].draw(state, u);
    const int seen = observations_[a].draw(state, Random::of(u).uniform());
    return {reward, static_cast<Observation>(seen), pomdp_->terminal()[state]};
  }
  double observationProbability(State next, int action, Observation o) const;
  double upperBound(State state) const;
  void addUpperBounds(State state, double* sums) const {
    const double* row = upper_.data() + static_cast<std::size_t>(state) * actions_;
    for (std::size_t a = 0; a < actions_; ++a) sums[a] += row[a];
  }
  LowerBound lowerBound(const State* states, int count) const;
  bool legal(State state, int action) const {
    return pomdp_->allowed().size() == 0 || pomdp_->allowed()(action, state);
  }
  std::unique_ptr<Belief<State>> makeBelief(std::uint64_t seed) const;

 private:
  /// Distributions to draw from, one a row.
  class AliasTable {
   public:
    AliasTable() = default;
    explicit AliasTable(const SparseRows& rows);
    [[nodiscard]] std::int32_t draw(int row, double u) const {
      const Entry* entries = entries_.data() + begin_[static_cast<std::size_t>(row)];
      const int count =
          begin_[static_cast<std::size_t>(row) + 1] - begin_[static_cast<std::size_t>(row)];
      const double place = u * count;
      const Entry& entry = entries[static_cast<int>(place)];
      return place - static_cast<int>(place) < entry.share ? entry.own : entry.other;
    }

   private:
    struct Entry {
      double share;  // of `own`
      std::int32_t own;
      std::int32_t other;
    };
    void addRow(const SparseRows& rows, int row);
    std::vector<std::int32_t> begin_ = {0};
    std::vector<Entry> entries_;
  };

  std::shared_ptr<const Pomdp> pomdp_;
  std::size_t actions_;
  std::int32_t states_;
  RewardRange range_;
  AliasTable start_;
  std::vector<AliasTable> transitions_;   // per action
  std::vector<AliasTable> observations_;  // per action, rows by the state reached
  std::vector<double> rewards_;           // (A, S)
  std::vector<double> upper_;             // (S, A)
  Eigen::MatrixXd lower_;                 // (K, S)
  std::vector<int> lower_actions_;        // (K,)
};

}  // namespace fabric::planner

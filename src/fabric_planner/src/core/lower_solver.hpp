// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "fabric_planner/bounds.hpp"
#include "fabric_planner/random.hpp"
#include "solver_model.hpp"
#include "vector_set.hpp"

namespace fabric::planner {

/// The best action at a belief by looking one step ahead with a set of vectors.
struct LookAhead {
  int action = -1;  ///< -1 when none is allowed
  double value = 0.0;
  std::vector<int> next;  ///< (O,): vector that is best after each observation
};

/// Point-based policy iteration, round by round; see pointBasedBound().
class LowerSolver {
 public:
  /// model: must outlive this. @throw ModelError as blindBound() does.
  LowerSolver(const SolverModel& model, std::uint64_t seed);

  /// The next round: begins along the policy of the fast informed bound, then gathers along its
  /// own.
  /// @return false when there is nothing left to gain.
  bool step(const PointBasedOptions& options);

  /// Simulates the policy that looks one step ahead; keeps up to `count` beliefs where that gains
  /// most, weighed by discount. @return how many.
  int gather(int episodes, int depth, int count);
  /// Adds up to `count` beliefs that the policy of other vectors (such as an upper bound's, one an
  /// action) meets; a beginning while the own policy is poor. @return how many.
  int follow(const AlphaVectors& policy, int episodes, int depth, int count);
  /// Adds a belief unless one as close is there.
  bool addBelief(const SparseBelief& belief);
  /// One round at all beliefs. @return the most that it gains at one of them.
  double improve();

  [[nodiscard]] const VectorSet& vectors() const { return vectors_; }
  [[nodiscard]] const std::vector<SparseBelief>& beliefs() const { return beliefs_; }
  /// Multiplications so far.
  [[nodiscard]] double work() const { return work_; }
  /// Value of the initial belief.
  [[nodiscard]] double root() const { return vectors_.best(beliefs_.front()).value; }
  /// The vectors, and those of the blind bound.
  [[nodiscard]] AlphaVectors bound() const;

 private:
  struct Met {
    SparseBelief belief;
    double gain;
  };

  /// One backup at each belief where any action is allowed.
  struct Backups {
    std::vector<const SparseBelief*> places;
    VectorSet vectors;
  };

  void lookAhead(const SparseBelief& belief, LookAhead& best);
  void simulate(int depth, Random random, std::vector<Met>& met);
  [[nodiscard]] bool hasEnded(const SparseBelief& belief) const;
  /// Draws what is seen after an action; false when nothing can be.
  bool moveOn(int action, Random& random, SparseBelief& belief);
  [[nodiscard]] bool isNear(const SparseBelief& belief) const;
  void bestSuccessors(const VectorSet& set, const SparseBelief& belief, int action,
                      std::vector<int>& next);
  void backUp(const VectorSet& set, const LookAhead& choice, double* alpha);
  Backups backUpAll();
  void evaluate(VectorSet& set, const std::vector<const SparseBelief*>& places);
  /// Keeps the vectors that are best at one of the beliefs.
  void prune();

  const SolverModel& m_;
  Random random_;
  std::uint64_t rounds_ = 0;
  bool begun_ = false;
  AlphaVectors blind_;
  VectorSet vectors_;
  std::vector<SparseBelief> beliefs_;
  Outcomes outcomes_;
  LookAhead trial_;
  double work_ = 0.0;
};

}  // namespace fabric::planner

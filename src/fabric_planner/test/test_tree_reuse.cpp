// SPDX-License-Identifier: BSD-3-Clause
// The search tree from one step to the next.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "fabric_planner/belief_filter.hpp"
#include "fabric_planner/evaluate.hpp"
#include "fabric_planner/online_planner.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

using testing::blankTables;
using testing::randomPomdp;
using testing::randomTables;
using testing::refusal;
using testing::takeLeaveLook;

constexpr double AMPLE = 1e6;  // s: a deadline that never ends a search

/// A planner and the belief it plays at, moved by random observations that have a chance.
class Play {
 public:
  Play(const std::shared_ptr<const Pomdp>& model, const PlannerOptions& options)
      : planner(model, options), filter(model) {}

  Decision decide() { return planner.decide(filter.belief()); }
  void step(int action, std::mt19937& random) {
    const Pomdp& m = planner.model();
    const Eigen::VectorXd predicted = m.T(action).transpose() * filter.belief();
    const Eigen::VectorXd chances = m.O(action).transpose() * predicted;
    std::discrete_distribution<int> draw(chances.begin(), chances.end());
    move(action, draw(random));
  }
  void move(int action, int observation) {
    filter.update(action, observation);
    planner.advance(action, observation);
  }

  OnlinePlanner planner;
  BeliefFilter filter;
};

bool same(const Decision& a, const Decision& b) {
  return a.action == b.action && a.value == b.value && a.lower_bound == b.lower_bound &&
         a.upper_bound == b.upper_bound && a.nodes == b.nodes && a.kept_nodes == b.kept_nodes &&
         a.ended_by == b.ended_by;
}

/// The entry of the belief after an action and an observation at the root.
TreeEntry child(const OnlinePlanner& planner, int action, int observation) {
  for (const TreeEntry& entry : planner.tree(1)) {
    if (entry.isBelief() && entry.action == action && entry.observation == observation) {
      return entry;
    }
  }
  ADD_FAILURE() << "no belief after " << action << ", " << observation;
  return {};
}

/// The model with states that nothing leads to, so that it counts as a large one.
std::shared_ptr<const Pomdp> widened(const PomdpTables& small, int extra) {
  const auto n = static_cast<int>(small.states.size());
  PomdpTables tables = blankTables(n + extra, static_cast<int>(small.actions.size()),
                                   static_cast<int>(small.observations.size()), small.discount);
  for (size_t a = 0; a < tables.T.size(); ++a) {
    tables.T[a].setIdentity();
    tables.T[a].topLeftCorner(n, n) = small.T[a];
    tables.O[a].col(0).setOnes();
    tables.O[a].topRows(n) = small.O[a];
  }
  tables.R.leftCols(n) = small.R;
  tables.initial_belief.setZero();
  tables.initial_belief.head(n) = small.initial_belief;
  return std::make_shared<Pomdp>(tables);
}

TEST(TreeReuse, GoesOnWithWhatWasSearchedBelowTheStepTaken) {
  std::mt19937 random(31);
  Play run(randomPomdp(random, 6, 3, 3, 0.95, 0.2), {AMPLE, 0.0, 300});
  int kept = 0;
  for (int i = 0; i < 20; ++i) {
    const int action = run.decide().action;
    std::vector<TreeEntry> below;
    for (int o = 0; o < 3; ++o) below.push_back(child(run.planner, action, o));
    const Eigen::VectorXd predicted =
        run.planner.model().T(action).transpose() * run.filter.belief();
    const auto o = static_cast<size_t>(random() % 3);
    ASSERT_GT(below[o].probability, 0.0);
    run.move(action, static_cast<int>(o));
    const Decision next = run.decide();
    EXPECT_EQ(next.kept_nodes, below[o].expanded);
    EXPECT_GE(next.lower_bound, below[o].lower);
    EXPECT_LE(next.upper_bound, below[o].upper);
    kept += next.kept_nodes;
  }
  EXPECT_GT(kept, 20);
}

TEST(TreeReuse, BoundsStayOnTheirSidesOfASearchFromScratch) {
  std::mt19937 random(32);
  for (int i = 0; i < 5; ++i) {
    const auto m = randomPomdp(random, 5, 3, 3, 0.9, 0.3);
    Play run(m, {AMPLE, 0.0, 60});
    OnlinePlanner afresh(m, {AMPLE, 1e-4, 3000});
    for (int t = 0; t < 15; ++t) {
      const Decision ours = run.decide();
      const Decision exact = afresh.decide(run.filter.belief());
      EXPECT_LE(ours.lower_bound, exact.upper_bound + 1e-9);
      EXPECT_GE(ours.upper_bound, exact.lower_bound - 1e-9);
      EXPECT_LE(ours.lower_bound, ours.upper_bound);
      run.step(ours.action, random);
    }
  }
}

TEST(TreeReuse, RepeatsARunExactlyAfterAReset) {
  std::mt19937 random(33);
  Play run(randomPomdp(random, 7, 3, 4, 0.95, 0.3), {AMPLE, 1e-6, 150});
  std::vector<Decision> first;
  for (int round = 0; round < 2; ++round) {
    std::mt19937 luck(34);
    run.filter.reset();
    run.planner.reset();
    for (size_t t = 0; t < 40; ++t) {
      const Decision decision = run.decide();
      if (round == 0) {
        first.push_back(decision);
      } else {
        EXPECT_TRUE(same(decision, first[t])) << "step " << t;
      }
      run.step(decision.action, luck);
    }
  }
}

TEST(TreeReuse, BeginsAgainAtABeliefThatIsNotTheNext) {
  std::mt19937 random(35);
  const auto m = randomPomdp(random, 5, 3, 3, 0.95);
  Play run(m, {AMPLE, 1e-6, 100});
  OnlinePlanner fresh(m, {AMPLE, 1e-6, 100});
  run.decide();
  run.planner.advance(0, 0);
  const Eigen::VectorXd elsewhere = testing::randomRow(random, 5, 0.0).transpose();
  EXPECT_TRUE(same(run.planner.decide(elsewhere), fresh.decide(elsewhere)));
}

TEST(TreeReuse, ForgetsTheTreeAfterWhatCannotHaveHappened) {
  const auto m = takeLeaveLook(0.5);
  OnlinePlanner planner(m, {AMPLE, 0.0, 50});
  planner.decide(m->initialBelief());
  planner.advance(2, 2);  // looking shows which it is, never nothing
  EXPECT_TRUE(planner.tree(3).empty());
  EXPECT_EQ(planner.decide(m->initialBelief()).kept_nodes, 0);
  planner.advance(2, 0);
  planner.advance(2, 0);  // two steps without a decision between them
  EXPECT_NEAR(planner.decide(Eigen::Vector3d(1.0, 0.0, 0.0)).value, 1.0, 1e-9);
}

TEST(TreeReuse, NeverHoldsMoreBeliefsThanItMayHoweverLongItRuns) {
  std::mt19937 random(36);
  Play run(randomPomdp(random, 5, 3, 3, 0.98, 0.2), {AMPLE, 0.0, 40});
  for (int t = 0; t < 200; ++t) {
    const Decision decision = run.decide();
    ASSERT_LE(decision.nodes, 40);
    int expanded = 0;
    for (const TreeEntry& entry : run.planner.tree(1000)) {
      expanded += entry.isBelief() && entry.expanded > 0 ? 1 : 0;
    }
    ASSERT_EQ(expanded, decision.nodes) << "step " << t;
    run.step(t % 3 == 0 ? static_cast<int>(random() % 3) : decision.action, random);
  }
}

TEST(TreeReuse, DescribesTheTreeLevelByLevel) {
  const auto m = takeLeaveLook(0.5);
  OnlinePlanner planner(m, {AMPLE, 1e-9, 1000});
  const Decision decision = planner.decide(m->initialBelief());
  const auto tree = planner.tree(1);
  ASSERT_GT(tree.size(), 4U);
  EXPECT_EQ(tree[0].parent, -1);
  EXPECT_EQ(tree[0].lower, decision.lower_bound);
  EXPECT_EQ(tree[0].expanded, decision.nodes);
  double reach = 0.0;
  for (size_t i = 1; i < tree.size(); ++i) {
    const TreeEntry& entry = tree[i];
    ASSERT_LT(entry.parent, static_cast<int>(i));
    EXPECT_NE(entry.isBelief(), tree[static_cast<size_t>(entry.parent)].isBelief());
    EXPECT_LE(entry.lower, entry.upper);
    if (entry.isBelief()) reach += entry.reach;
  }
  EXPECT_NEAR(reach, 3.0, 1e-12) << "each of three actions leads somewhere for certain";
  for (const TreeEntry& entry : planner.tree(5, 0.4)) EXPECT_GE(entry.reach, 0.4);
}

TEST(TreeReuse, GoesTheSameWayThroughDenseAndSparseTables) {
  std::mt19937 random(37);
  for (int i = 0; i < 5; ++i) {
    const PomdpTables tables = randomTables(random, 6, 3, 4, 0.95, 0.4);
    const auto small = std::make_shared<Pomdp>(tables);
    const auto large = widened(tables, 70);
    AlphaVectors lower = blindBound(*small);
    AlphaVectors upper = fastInformedBound(*small);
    OnlinePlanner dense(small, {AMPLE, 0.0, 80}, lower, PointUpperBound(upper));
    lower.vectors.conservativeResizeLike(Eigen::MatrixXd::Zero(lower.vectors.rows(), 76));
    upper.vectors.conservativeResizeLike(Eigen::MatrixXd::Zero(upper.vectors.rows(), 76));
    OnlinePlanner sparse(large, {AMPLE, 0.0, 80}, lower, PointUpperBound(upper));
    BeliefFilter one(small);
    BeliefFilter other(large);
    for (int t = 0; t < 10; ++t) {
      const Decision a = dense.decide(one.belief());
      const Decision b = sparse.decide(other.belief());
      EXPECT_NEAR(a.lower_bound, b.lower_bound, 1e-9);
      EXPECT_NEAR(a.upper_bound, b.upper_bound, 1e-9);
      const int observation = static_cast<int>(random() % 4);
      EXPECT_EQ(one.update(a.action, observation), other.update(a.action, observation));
      EXPECT_LT((other.belief().head(6) - one.belief()).cwiseAbs().maxCoeff(), 1e-12);
      dense.advance(a.action, observation);
      sparse.advance(a.action, observation);
    }
  }
}

/// Two rooms; only in "left" may one go right, only in "right" may one go left.
PomdpTables rooms() {
  PomdpTables tables = blankTables(2, 3, 2, 0.9);
  tables.states = {"left", "right"};
  tables.actions = {"go_right", "go_left", "stay"};
  tables.T[0].col(1).setOnes();
  tables.T[1].col(0).setOnes();
  tables.T[2].setIdentity();
  for (auto& table : tables.O) table.setIdentity();
  tables.R << 1.0, 9.0, 9.0, 1.0, 0.0, 0.0;
  tables.allowed.resize(3, 2);
  tables.allowed << true, false, false, true, true, true;
  return tables;
}

TEST(ActionSets, ForbiddenActionsAreNeverTakenHoweverGood) {
  const auto m = std::make_shared<Pomdp>(rooms());
  AlphaVectors lower{Eigen::MatrixXd::Zero(1, 2), {2}};
  AlphaVectors upper{Eigen::MatrixXd::Constant(1, 2, 90.0), {0}};
  for (const int nodes : {0, 1, 50, 1000}) {
    OnlinePlanner planner(m, {AMPLE, 1e-6, nodes}, lower, PointUpperBound(upper));
    for (const auto& entry : planner.tree(3)) EXPECT_GE(entry.upper, entry.lower);
    const int here = planner.decide(Eigen::Vector2d(1.0, 0.0)).action;
    EXPECT_EQ(here, nodes == 0 ? 2 : 0);
    EXPECT_EQ(planner.decide(Eigen::Vector2d(0.5, 0.5)).action, 2) << "allowed in both";
  }
  OnlinePlanner planner(m, {AMPLE, 1e-3, 1000}, lower, PointUpperBound(upper));
  const Decision decision = planner.decide(Eigen::Vector2d(1.0, 0.0));
  EXPECT_LE(decision.lower_bound, 10.0 + 1e-9) << "1 for ever, never 9";
  EXPECT_GE(decision.upper_bound, 10.0 - 1e-9);
}

TEST(ActionSets, ABeliefWithoutAnyAllowedActionIsRefused) {
  PomdpTables tables = rooms();
  tables.allowed.row(2).setConstant(false);
  const auto m = std::make_shared<Pomdp>(tables);
  OnlinePlanner planner(m, {AMPLE, 1e-3, 100}, {Eigen::MatrixXd::Zero(1, 2), {2}},
                        PointUpperBound({Eigen::MatrixXd::Constant(1, 2, 90.0), {0}}));
  EXPECT_EQ(refusal([&] { planner.decide(Eigen::Vector2d(0.5, 0.5)); }),
            "test: no action is allowed in every state that is possible");
  EXPECT_EQ(planner.decide(Eigen::Vector2d(1.0, 0.0)).action, 0);
}

TEST(OnlinePlannerBounds, OfAnotherShapeAreRefused) {
  const auto m = takeLeaveLook(0.5);
  const PointUpperBound upper(qmdp(*m));
  EXPECT_EQ(refusal([&] {
              OnlinePlanner(m, {}, {Eigen::MatrixXd::Zero(1, 2), {0}}, upper);
            }),
            "test: the lower bound is of shape (1, 2), expected at least one vector of 3");
  EXPECT_EQ(refusal([&] {
              OnlinePlanner(m, {}, {Eigen::MatrixXd::Constant(1, 3, NAN), {0}}, upper);
            }),
            "test: the lower bound has an entry that is not finite");
  EXPECT_THROW(OnlinePlanner(m, {}, {Eigen::MatrixXd::Zero(1, 3), {7}}, upper), std::out_of_range);
}

TEST(TreeReuse, ServesThreadsThatAdvanceAndLookWhileOthersDecide) {
  const auto m = takeLeaveLook(0.5);
  OnlinePlanner planner(m, {AMPLE, 0.0, 50});
  std::vector<std::thread> threads;
  for (int k = 0; k < 3; ++k) {
    threads.emplace_back([&planner, k] {
      for (int i = 0; i < 50; ++i) {
        if (k == 0) {
          EXPECT_GE(planner.decide(Eigen::Vector3d(0.5, 0.5, 0.0)).value, 0.35 - 1e-9);
        } else if (k == 1) {
          planner.advance(2, 0);
        } else {
          EXPECT_LE(planner.tree(1).size(), 13U);
        }
      }
    });
  }
  for (auto& thread : threads) thread.join();
}

}  // namespace
}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "fabric_planner/particle_belief.hpp"
#include "fabric_planner/tabular_model.hpp"
#include "sample_models.hpp"

namespace fabric::planner {
namespace {

/// A walker on the cells 0 to 9 of a ring that steps on by one and sees its cell; it begins at 0
/// or 1. Cells from 10 on are never observed.
struct Walker {
  using State = std::uint8_t;
  [[nodiscard]] int numActions() const { return 1; }
  [[nodiscard]] double discount() const { return 0.9; }
  [[nodiscard]] std::vector<std::string> actionNames() const { return {"walk"}; }
  [[nodiscard]] RewardRange rewardRange() const { return {0.0, 1.0}; }
  State initialState(Random& random) const { return static_cast<State>(random.below(2)); }
  Step step(State& state, int /*action*/, double /*u*/) const {
    state = static_cast<State>((state + 1) % 10);
    return {0.0, state, false};
  }
  double observationProbability(const State& next, int /*action*/, Observation o) const {
    return o == next ? 1.0 : 0.0;
  }
};

/// The same, and it knows where to put particles that were wrong.
struct HelpfulWalker : Walker {
  State recover(int /*action*/, Observation o, Random& /*random*/) const {
    return static_cast<State>(o);
  }
};

/// Half of the steps end it; the others show whether the number was small.
struct Mortal : Walker {
  Step step(State& state, int /*action*/, double u) const {
    state = u < 0.25 ? 3 : 4;
    return {0.0, 1, u >= 0.5};
  }
  double observationProbability(const State& /*next*/, int /*action*/, Observation o) const {
    return o == 1 ? 1.0 : 0.0;
  }
};

/// A tabular model seen without its observation probabilities.
struct Silent {
  using State = TabularModel::State;
  const TabularModel* inner;
  [[nodiscard]] int numActions() const { return inner->numActions(); }
  [[nodiscard]] double discount() const { return inner->discount(); }
  [[nodiscard]] std::vector<std::string> actionNames() const { return inner->actionNames(); }
  [[nodiscard]] RewardRange rewardRange() const { return inner->rewardRange(); }
  State initialState(Random& random) const { return inner->initialState(random); }
  Step step(State& state, int action, double u) const { return inner->step(state, action, u); }
};

template <class Model>
void expectNearExact(const Model& model, const TabularModel& table) {
  ParticleBelief<Model> particles(model, 3, {20000, 10});
  BeliefFilter exact(std::make_shared<Pomdp>(table.pomdp()));
  Random random(8);
  TabularModel::State state = table.initialState(random);
  for (int t = 0; t < 20; ++t) {
    const int action = random.below(table.numActions());
    const Step step = table.step(state, action, random.uniform());
    particles.update(action, step.observation);
    exact.update(action, static_cast<int>(step.observation));
    Eigen::VectorXd share = Eigen::VectorXd::Zero(table.pomdp().numStates());
    for (const auto particle : particles.particles()) share(particle) += 1.0 / 20000.0;
    EXPECT_LT((share - exact.belief()).cwiseAbs().maxCoeff(), 0.03) << "step " << t;
  }
  EXPECT_EQ(particles.recoveries(), 0U);
}

TEST(ParticleBelief, followsTheExactBelief) {
  std::mt19937 random(2);
  const TabularModel model(testing::randomPomdp(random, 5, 2, 3, 0.9));
  expectNearExact(model, model);
}

TEST(ParticleBelief, followsTheExactBeliefWithoutObservationProbabilities) {
  std::mt19937 random(2);
  const TabularModel model(testing::randomPomdp(random, 5, 2, 3, 0.9));
  expectNearExact(Silent{&model}, model);
}

TEST(ParticleBelief, startsAgainFromFreshParticlesWhenItsOwnAreImpossible) {
  const Walker model;
  ParticleBelief<Walker> belief(model, 1, {100, 10});
  EXPECT_EQ(belief.update(0, 1), UpdateStatus::OK);
  EXPECT_EQ(belief.recoveries(), 0U);
  EXPECT_EQ(belief.update(0, 1), UpdateStatus::RECOVERED);  // only from the beginning
  EXPECT_EQ(belief.recoveries(), 1U);
  for (const auto particle : belief.particles()) EXPECT_EQ(particle, 1);
}

TEST(ParticleBelief, keepsThePredictionWhenNothingExplainsTheObservation) {
  const Walker model;
  ParticleBelief<Walker> belief(model, 1, {100, 10});
  EXPECT_EQ(belief.update(0, 99), UpdateStatus::RECOVERED);
  EXPECT_EQ(belief.recoveries(), 1U);
  for (const auto particle : belief.particles()) EXPECT_TRUE(particle == 1 || particle == 2);
  EXPECT_EQ(belief.update(0, 2), UpdateStatus::OK);
  belief.reset(1);
  EXPECT_EQ(belief.recoveries(), 0U);
}

TEST(ParticleBelief, takesTheModelsStatesWhenNothingElseExplainsTheObservation) {
  const HelpfulWalker model;
  ParticleBelief<HelpfulWalker> belief(model, 1, {100, 10});
  EXPECT_EQ(belief.update(0, 7), UpdateStatus::RECOVERED);
  for (const auto particle : belief.particles()) EXPECT_EQ(particle, 7);
}

TEST(ParticleBelief, knowsThatTheEpisodeGoesOn) {
  const Mortal model;
  ParticleBelief<Mortal> belief(model, 1, {2000, 10});
  EXPECT_EQ(belief.update(0, 1), UpdateStatus::OK);
  const auto& particles = belief.particles();
  const auto threes = std::count(particles.begin(), particles.end(), 3);
  EXPECT_NEAR(static_cast<double>(threes), 1000.0, 120.0);
}

TEST(ParticleBelief, repeatsForASeed) {
  std::mt19937 random(2);
  const TabularModel model(testing::randomPomdp(random, 5, 2, 3, 0.9));
  const auto run = [&](std::uint64_t seed) {
    ParticleBelief<TabularModel> belief(model, 99, {50, 10});
    belief.reset(seed);
    belief.update(1, 2);
    return belief.particles();
  };
  EXPECT_EQ(run(4), run(4));
  EXPECT_NE(run(4), run(5));
}

TEST(ParticleBelief, refusesOptionsByName) {
  const Walker model;
  const auto refused = [&](ParticleOptions options) {
    return testing::refusal([&] { ParticleBelief<Walker> belief(model, 1, options); });
  };
  EXPECT_NE(refused({0, 1}).find("particles is 0"), std::string::npos);
  EXPECT_NE(refused({1, -1}).find("recovery_tries is -1"), std::string::npos);
}

TEST(SystematicDraw, takesEachItemInProportionToWithinOne) {
  Random random(6);
  for (int round = 0; round < 200; ++round) {
    std::vector<double> weights(20);
    for (double& w : weights) w = random.uniform() < 0.3 ? 0.0 : random.uniform();
    weights[3] = 0.5;
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    std::vector<int> taken(20, 0);
    systematicDraw(random, weights.data(), 20, total, 500,
                   [&](int i) { ++taken[static_cast<size_t>(i)]; });
    ASSERT_EQ(std::accumulate(taken.begin(), taken.end(), 0), 500);
    for (size_t i = 0; i < 20; ++i) {
      ASSERT_NEAR(taken[i], 500.0 * weights[i] / total, 1.0 + 1e-9);
      if (weights[i] == 0.0) {
        ASSERT_EQ(taken[i], 0);
      }
    }
  }
}

TEST(TabularModel, drawsItsTables) {
  std::mt19937 generator(9);
  const auto pomdp = testing::randomPomdp(generator, 6, 2, 4, 0.9, 0.4);
  const TabularModel model(pomdp);
  Random random(1);
  const int draws = 40000;
  for (int s = 0; s < 6; ++s) {
    Eigen::VectorXd states = Eigen::VectorXd::Zero(6);
    Eigen::VectorXd seen = Eigen::VectorXd::Zero(4);
    for (int i = 0; i < draws; ++i) {
      TabularModel::State state = s;
      const Step step = model.step(state, 1, random.uniform());
      states(state) += 1.0 / draws;
      seen(static_cast<Eigen::Index>(step.observation)) += 1.0 / draws;
      ASSERT_EQ(step.reward, pomdp->R()(1, s));
      ASSERT_GT(model.observationProbability(state, 1, step.observation), 0.0);
    }
    const Eigen::VectorXd expected = Eigen::MatrixXd(pomdp->T(1)).row(s).transpose();
    EXPECT_LT((states - expected).cwiseAbs().maxCoeff(), 0.012);
    const Eigen::VectorXd observed = Eigen::MatrixXd(pomdp->O(1)).transpose() * expected;
    EXPECT_LT((seen - observed).cwiseAbs().maxCoeff(), 0.012);
  }
}

TEST(Random, givesTheSameNumbersOnEveryMachine) {
  Random random(1);
  EXPECT_EQ(random.bits(), Random(1).bits());
  EXPECT_NE(Random(1).bits(), Random(2).bits());
  EXPECT_NE(Random(1).child(1).bits(), Random(1).child(2).bits());
  double mean = 0.0;
  double square = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double x = random.normal();
    mean += x / 100000.0;
    square += x * x / 100000.0;
  }
  EXPECT_NEAR(mean, 0.0, 0.015);
  EXPECT_NEAR(square, 1.0, 0.02);
}

}  // namespace
}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "fabric_planner/despot.hpp"
#include "fabric_planner/episodes.hpp"
#include "fabric_planner/examples/rock_sample.hpp"
#include "fabric_planner/examples/tag.hpp"
#include "sample_models.hpp"

namespace fabric::planner::examples {
namespace {

/// Brute force: the best value over every order in which some rocks of the set are taken.
double bestTour(const RockSample& model, int cell, unsigned set) {
  const int n = model.size();
  double best = 10.0 * std::pow(0.95, n - 1 - cell % n);
  for (int i = 0; i < model.rocks(); ++i) {
    if (((set >> i) & 1U) == 0) continue;
    const int to = model.rockCell(i);
    const int d = std::abs(to % n - cell % n) + std::abs(to / n - cell / n);
    const double rest = bestTour(model, to, set & ~(1U << i));
    best = std::max(best, std::pow(0.95, d) * (10.0 + 0.95 * rest));
  }
  return best;
}

/// Mean discounted return of the model's lower-bound policy from the initial belief.
template <class Model>
EpisodeSummary runDefault(const Model& model, int episodes) {
  DespotOptions options;
  options.deadline = 1000.0;
  options.max_nodes = 0;
  Despot<Model> planner(model, options);
  return summarise(runEpisodes(model, planner, episodes, 1, {200}));
}

/// The model's lower bound at its initial belief.
template <class Model>
double lowerBoundAtStart(const Model& model) {
  Random random(1);
  std::vector<typename Model::State> states(20000);
  model.makeBelief(0)->sample(random, 20000, states.data());
  return model.lowerBound(states.data(), 20000).value;
}

TEST(Tag, movesTheOpponentAwayAsPublished) {
  const Tag model;
  const auto share = [&](int robot, int opponent) {
    std::map<int, int> counts;
    for (int k = 0; k < 1000; ++k) {
      Tag::State state{static_cast<std::uint8_t>(robot), static_cast<std::uint8_t>(opponent)};
      model.step(state, 0, (k + 0.5) / 1000.0);
      ++counts[state.opponent];
    }
    return counts;
  };
  // Cell x + 10 y in the lower rows. South-west of the opponent: it goes east or north.
  EXPECT_EQ(share(0, 16), (std::map<int, int>{{16, 200}, {17, 400}, {21, 400}}));
  // On the same column below it: 0.4 north, 0.2 to either side, 0.2 stays.
  EXPECT_EQ(share(5, 15), (std::map<int, int>{{15, 200}, {14, 200}, {16, 200}, {20, 400}}));
  // In the corner away from the robot there is no way out.
  EXPECT_EQ(share(0, 19), (std::map<int, int>{{19, 1000}}));
}

TEST(Tag, paysAndEndsAsPublished) {
  const Tag model;
  Tag::State state{4, 4};
  const Step caught = model.step(state, Tag::TAG, 0.3);
  EXPECT_EQ(caught.reward, 10.0);
  EXPECT_TRUE(caught.terminal);
  state = {4, 9};
  EXPECT_EQ(model.step(state, Tag::TAG, 0.3).reward, -10.0);
  state = {0, 9};
  const Step moved = model.step(state, 3, 0.3);  // into the wall
  EXPECT_EQ(moved.reward, -1.0);
  EXPECT_EQ(moved.observation, 0U);
  state = {1, 0};
  EXPECT_EQ(model.step(state, 3, 0.9).observation, Tag::SAME);
}

TEST(Tag, boundsItsStatesFromBothSides) {
  const Tag model;
  for (int robot = 0; robot < Tag::CELLS; ++robot) {
    for (int opponent = 0; opponent < Tag::CELLS; ++opponent) {
      const Tag::State state{static_cast<std::uint8_t>(robot), static_cast<std::uint8_t>(opponent)};
      ASSERT_LE(model.lowerBound(&state, 1).value, model.upperBound(state) + 1e-3);
    }
  }
  const Tag::State caught{7, 7};
  EXPECT_NEAR(model.upperBound(caught), 10.0, 1e-3);
  EXPECT_NEAR(model.lowerBound(&caught, 1).value, 10.0, 1e-3);
}

TEST(Tag, earnsAtLeastItsLowerBound) {
  const Tag model;
  const EpisodeSummary played = runDefault(model, 500);
  // Deciding anew from the exact belief can only be better than the first plan.
  EXPECT_GT(played.discounted + 3.0 * played.discounted_error, lowerBoundAtStart(model));
  EXPECT_GT(played.discounted, -8.0);
}

TEST(Tag, believesExactly) {
  const Tag model;
  const auto exact = model.makeBelief(0);
  ParticleBelief<Tag> particles(model, 3, {40000, 10});
  for (const auto& [action, seen] : {std::pair(1, 6), std::pair(1, 7), std::pair(0, 17)}) {
    EXPECT_EQ(exact->update(action, static_cast<Observation>(seen)), UpdateStatus::OK);
    EXPECT_EQ(particles.update(action, static_cast<Observation>(seen)), UpdateStatus::OK);
  }
  std::vector<Tag::State> drawn(40000);
  Random random(1);
  exact->sample(random, 40000, drawn.data());
  std::vector<double> difference(Tag::CELLS, 0.0);
  for (size_t i = 0; i < drawn.size(); ++i) {
    EXPECT_EQ(drawn[i].robot, 17);
    difference[drawn[i].opponent] += 1.0 / 40000.0;
    difference[particles.particles()[i].opponent] -= 1.0 / 40000.0;
  }
  for (const double d : difference) EXPECT_NEAR(d, 0.0, 0.01);
  EXPECT_EQ(exact->update(0, 3), UpdateStatus::RECOVERED);
  EXPECT_EQ(exact->recoveries(), 1U);
  EXPECT_EQ(exact->sample(random).robot, 3);
}

TEST(RockSample, knowsTheBestTourForEverySetOfRocks) {
  const RockSample model(5, 5);
  for (unsigned set = 0; set < 32; ++set) {
    for (int cell = 0; cell < 25; ++cell) {
      const double best = bestTour(model, cell, set);
      const double found = model.known(cell, static_cast<int>(set));
      ASSERT_GE(found, best - 1e-4);
      ASSERT_LE(found, best + 5.0 / 256.0);
    }
  }
}

TEST(RockSample, paysAsPublished) {
  const RockSample model(7, 8);
  const int rock = 2;  // at (3, 1)
  RockSample::State state{static_cast<std::uint16_t>(model.rockCell(rock)), 0xff};
  EXPECT_EQ(state.cell, 3 + 7 * 1);
  EXPECT_EQ(model.step(state, RockSample::SAMPLE, 0.5).reward, 10.0);
  EXPECT_EQ(model.step(state, RockSample::SAMPLE, 0.5).reward, -10.0);
  EXPECT_EQ(state.rocks, 0xff & ~(1 << rock));
  EXPECT_EQ(model.step(state, RockSample::CHECK + rock, 0.999).observation, RockSample::BAD);
  state.cell = 6;
  EXPECT_FALSE(model.legal(state, RockSample::SOUTH));
  EXPECT_FALSE(model.legal(state, RockSample::SAMPLE));
  EXPECT_EQ(model.step(state, RockSample::SOUTH, 0.5).reward, -100.0);
  const Step out = model.step(state, RockSample::EAST, 0.5);
  EXPECT_EQ(out.reward, 10.0);
  EXPECT_TRUE(out.terminal);
  EXPECT_NEAR(model.accuracy(model.rockCell(0), 0), 1.0, 1e-12);
  const RockSample wide(21, 1);
  const int rock_cell = wide.rockCell(0);
  const double d = std::hypot(rock_cell % 21, rock_cell / 21);
  EXPECT_NEAR(wide.accuracy(0, 0), 0.5 + 0.5 * std::pow(2.0, -d / 20.0), 1e-12);
}

TEST(RockSample, boundsBeliefsFromBothSides) {
  const RockSample model(7, 8);
  Random random(4);
  std::vector<double> sums(static_cast<size_t>(model.numActions()));
  for (int round = 0; round < 300; ++round) {
    const int count = 1 + random.below(30);
    const auto cell = static_cast<std::uint16_t>(random.below(49));
    std::vector<RockSample::State> states;
    std::fill(sums.begin(), sums.end(), 0.0);
    double known = 0.0;
    for (int i = 0; i < count; ++i) {
      states.push_back({cell, static_cast<std::uint16_t>(random.below(256))});
      model.addUpperBounds(states.back(), sums.data());
      known += model.upperBound(states.back());
    }
    const LowerBound lower = model.lowerBound(states.data(), count);
    const double upper = *std::max_element(sums.begin(), sums.end());
    ASSERT_LE(count * lower.value, upper + 1e-6 * count);
    ASSERT_LE(upper, known + 0.02 * count);
    ASSERT_TRUE(model.legal(states[0], lower.action));
  }
}

TEST(RockSample, earnsAtLeastItsLowerBound) {
  const RockSample model(7, 8);
  const EpisodeSummary played = runDefault(model, 300);
  EXPECT_GT(played.discounted + 3.0 * played.discounted_error, lowerBoundAtStart(model));
}

TEST(RockSample, believesExactly) {
  const RockSample model(7, 8);
  const auto belief = model.makeBelief(0);
  const double right = model.accuracy(model.startCell(), 3);
  belief->update(RockSample::CHECK + 3, RockSample::GOOD);
  belief->update(RockSample::CHECK + 3, RockSample::GOOD);
  belief->update(RockSample::CHECK + 3, RockSample::BAD);
  std::vector<RockSample::State> states(10000);
  Random random(2);
  belief->sample(random, 10000, states.data());
  std::vector<int> good(8, 0);
  for (const auto& state : states) {
    for (size_t r = 0; r < 8; ++r) good[r] += (state.rocks >> r) & 1;
  }
  EXPECT_NEAR(good[3], 10000.0 * right, 1.0);  // one GOOD and the BAD cancel
  EXPECT_NEAR(good[4], 5000.0, 1.0);
  EXPECT_EQ(belief->update(RockSample::EAST, RockSample::GOOD), UpdateStatus::RECOVERED);
  EXPECT_EQ(belief->recoveries(), 1U);
}

TEST(RockSample, isPlannedWellByDespot) {
  const RockSample model(4, 4);
  DespotOptions options;
  options.deadline = 1000.0;
  options.max_nodes = 100;
  options.scenarios = 100;
  Despot<RockSample> planner(model, options);
  const EpisodeSummary searched = summarise(runEpisodes(model, planner, 40, 1));
  const EpisodeSummary played = runDefault(model, 40);
  EXPECT_GT(searched.discounted, played.discounted);
  EXPECT_EQ(searched.recoveries, 0U);
}

TEST(RockSample, refusesSizesByName) {
  const auto refused = [](int n, int k) {
    return testing::refusal([&] { RockSample model(n, k); });
  };
  EXPECT_NE(refused(1, 1).find("n is 1"), std::string::npos);
  EXPECT_NE(refused(7, 17).find("k is 17"), std::string::npos);
  EXPECT_NE(refused(2, 5).find("k is 5"), std::string::npos);
}

}  // namespace
}  // namespace fabric::planner::examples

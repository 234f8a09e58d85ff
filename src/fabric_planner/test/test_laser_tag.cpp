// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "fabric_planner/despot.hpp"
#include "fabric_planner/episodes.hpp"
#include "fabric_planner/examples/laser_tag.hpp"
#include "fabric_planner/examples/tiger.hpp"
#include "sample_models.hpp"

namespace fabric::planner::examples {
namespace {

using State = LaserTag::State;

State at(int robot, int opponent) {
  return {static_cast<std::uint8_t>(robot), static_cast<std::uint8_t>(opponent)};
}

/// rows x columns cells without obstacles, numbered row by row.
LaserTag floor(int rows, int columns, ReadingNoise noise = ReadingNoise::SHORT) {
  LaserTagOptions options;
  options.rows = rows;
  options.columns = columns;
  options.obstacles = 0;
  options.noise = noise;
  return LaserTag(options);
}

Observation withReading(Observation observation, int beam, int reading) {
  const Observation hole = ~(Observation{0xFF} << (8 * beam));
  return (observation & hole) | (static_cast<Observation>(reading) << (8 * beam));
}

TEST(LaserTag, HasThePublishedNumberOfStates) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    LaserTagOptions options;
    options.layout_seed = seed;
    const LaserTag model(options);
    EXPECT_EQ(model.numCells(), 69);
    EXPECT_EQ(model.numCells() * (model.numCells() + 1), 4830);
  }
}

TEST(LaserTag, TheLayoutFollowsItsSeed) {
  LaserTagOptions options;
  const auto places = [&](std::uint64_t seed) {
    options.layout_seed = seed;
    const LaserTag model(options);
    std::vector<std::array<int, 2>> all;
    for (int cell = 0; cell < model.numCells(); ++cell) all.push_back(model.place(cell));
    return all;
  };
  EXPECT_EQ(places(5), places(5));
  EXPECT_NE(places(5), places(6));
}

TEST(LaserTag, TheOpponentFleesAsPublished) {
  const LaserTag model = floor(3, 3);
  //  0 1 2
  //  3 4 5    robot in 3, opponent in 4: east 0.4, north and south 0.2 each, stays 0.2
  //  6 7 8
  const std::vector<double> level = {0, 0.2, 0, 0, 0.2, 0.4, 0, 0.2, 0};
  const std::vector<double> corner = {0, 0, 1, 0, 0, 0, 0, 0, 0};  // walls on both ways out
  const std::vector<double> same = {0, 0.2, 0, 0.2, 0.2, 0.2, 0, 0.2, 0};
  for (std::size_t cell = 0; cell < 9; ++cell) {
    EXPECT_NEAR(model.flight(3, 4)[cell], level[cell], 1e-6) << cell;
    EXPECT_NEAR(model.flight(4, 2)[cell], corner[cell], 1e-6) << cell;
    EXPECT_NEAR(model.flight(4, 4)[cell], same[cell], 1e-6) << cell;
  }
}

TEST(LaserTag, StepsMoveTheOpponentAsOftenAsFlightSays) {
  const LaserTag model;
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    const State start = model.initialState(random);
    const auto p = model.flight(start.robot, start.opponent);
    std::vector<double> share(p.size(), 0.0);
    for (int k = 0; k < 4000; ++k) {
      State state = start;
      model.step(state, 0, random.uniform());
      share[state.opponent] += 1.0 / 4000;
      EXPECT_EQ(state.robot, model.neighbour(start.robot, 0));
    }
    for (std::size_t cell = 0; cell < p.size(); ++cell) EXPECT_NEAR(share[cell], p[cell], 0.04);
  }
}

TEST(LaserTag, TaggingPaysOnlyOnTheOpponentsCell) {
  const LaserTag model;
  State state = at(5, 5);
  const Step hit = model.step(state, LaserTag::TAG, 0.5);
  EXPECT_EQ(hit.reward, 10.0);
  EXPECT_TRUE(hit.terminal);
  EXPECT_TRUE(model.isTerminal(state));
  EXPECT_EQ(model.upperBound(state), 0.0);
  state = at(5, 6);
  const Step miss = model.step(state, LaserTag::TAG, 0.5);
  EXPECT_EQ(miss.reward, -10.0);
  EXPECT_FALSE(miss.terminal);
  EXPECT_EQ(state.robot, 5);
}

TEST(LaserTag, BeamsMeasureToTheNextThingInTheirWay) {
  const LaserTag model = floor(3, 5);
  //  0  1  2  3  4
  //  5  6  7  8  9     robot in 6, opponent in 9
  // 10 11 12 13 14
  const double diagonal = std::sqrt(2.0);
  const std::vector<double> expected = {
      2, 3, 2, 2, 2 * diagonal, 2 * diagonal, 2 * diagonal, 2 * diagonal};
  for (int beam = 0; beam < LaserTag::NUM_BEAMS; ++beam) {
    EXPECT_NEAR(model.distance(at(6, 9), beam), expected[static_cast<std::size_t>(beam)], 1e-12)
        << beam;
  }
}

TEST(LaserTag, ReadingsFollowTheNormalDistribution) {
  // By hand: a wall at distance 2. SHORT reads 1 when |N| <= 1 and 0 otherwise, never 2.
  // SYMMETRIC reads 0 when N < -1 and 1 when -1 <= N < 0.
  const auto phi = [](double x) { return 0.5 * std::erfc(-x / 2.5 / std::sqrt(2.0)); };
  const auto share = [](const LaserTag& model, int reading) {
    double one = 0.0;
    double all = 0.0;
    Random random(1);
    const Observation seen = model.observe(at(6, 9), random);
    for (int k = 0; k < LaserTag::NUM_READINGS; ++k) {
      const double p = model.observationProbability(at(6, 9), 0, withReading(seen, 0, k));
      all += p;
      one += k == reading ? p : 0.0;
    }
    return one / all;
  };
  const LaserTag few = floor(3, 5);
  EXPECT_NEAR(share(few, 1), 2.0 * phi(1.0) - 1.0, 1e-6);
  EXPECT_NEAR(share(few, 0), 2.0 - 2.0 * phi(1.0), 1e-6);
  EXPECT_EQ(share(few, 2), 0.0);
  const LaserTag both = floor(3, 5, ReadingNoise::SYMMETRIC);
  EXPECT_NEAR(share(both, 0), phi(-1.0), 1e-6);
  EXPECT_NEAR(share(both, 1), 0.5 - phi(-1.0), 1e-6);
  EXPECT_NEAR(share(both, 4), phi(3.0) - phi(2.0), 1e-6);
}

/// Sum of P(o | s) over all observations: the beams are independent, so that for any o it is
/// P(o) / prod_b (P(o) / S_b), S_b the sum over the readings of beam b alone.
double totalProbability(const LaserTag& model, State state, Observation seen) {
  const double p = model.observationProbability(state, 0, seen);
  double total = p;
  for (int beam = 0; beam < LaserTag::NUM_BEAMS; ++beam) {
    double sum = 0.0;
    for (int k = 0; k < LaserTag::NUM_READINGS; ++k) {
      sum += model.observationProbability(state, 0, withReading(seen, beam, k));
    }
    total *= sum / p;
  }
  return total;
}

TEST(LaserTag, ObservationProbabilitiesSumToOneAndMatchFrequencies) {
  for (const auto noise : {ReadingNoise::SHORT, ReadingNoise::SYMMETRIC}) {
    LaserTagOptions options;
    options.noise = noise;
    const LaserTag model(options);
    Random random(7);
    for (int i = 0; i < 10; ++i) {
      const State state = at(random.below(34), 35 + random.below(34));
      constexpr int DRAWS = 8000;
      std::array<std::array<int, LaserTag::NUM_READINGS>, LaserTag::NUM_BEAMS> count{};
      Observation seen = 0;
      for (int k = 0; k < DRAWS; ++k) {
        seen = model.observe(state, Random::of(random.uniform()));
        for (int b = 0; b < LaserTag::NUM_BEAMS; ++b) {
          ++count[static_cast<std::size_t>(b)][static_cast<std::size_t>(model.reading(seen, b))];
        }
      }
      EXPECT_NEAR(totalProbability(model, state, seen), 1.0, 1e-5);
      double chi_square = 0.0;
      int freedom = 0;
      for (int b = 0; b < LaserTag::NUM_BEAMS; ++b) {
        double sum = 0.0;
        std::array<double, LaserTag::NUM_READINGS> p{};
        for (int k = 0; k < LaserTag::NUM_READINGS; ++k) {
          p[static_cast<std::size_t>(k)] =
              model.observationProbability(state, 0, withReading(seen, b, k));
          sum += p[static_cast<std::size_t>(k)];
        }
        for (std::size_t k = 0; k < p.size(); ++k) {
          const double expected = p[k] / sum * DRAWS;
          const int found = count[static_cast<std::size_t>(b)][k];
          if (expected == 0.0) {
            EXPECT_EQ(found, 0);
          }
          if (expected < 5.0) continue;
          chi_square += (found - expected) * (found - expected) / expected;
          ++freedom;
        }
      }
      EXPECT_LT(chi_square, freedom + 5.0 * std::sqrt(2.0 * freedom));
    }
  }
}

TEST(LaserTag, TheSameCellIsSeenForSure) {
  const LaserTag model;
  EXPECT_EQ(model.observationProbability(at(4, 4), 0, LaserTag::SAME_CELL), 1.0);
  EXPECT_EQ(model.observationProbability(at(4, 4), 0, 0), 0.0);
  EXPECT_EQ(model.observationProbability(at(4, 5), 0, LaserTag::SAME_CELL), 0.0);
}

TEST(LaserTag, TheUpperBoundIsTheValueOfSeeingEverything) {
  const LaserTag model;
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    const State state = model.initialState(random);
    std::array<double, LaserTag::NUM_ACTIONS> q{};
    model.addUpperBounds(state, q.data());
    EXPECT_NEAR(*std::max_element(q.begin(), q.end()), model.upperBound(state), 1e-4);
    const auto p = model.flight(state.robot, state.opponent);
    double east = -1.0;
    for (int next = 0; next < model.numCells(); ++next) {
      east += 0.95 * p[static_cast<std::size_t>(next)] *
              model.upperBound(at(model.neighbour(state.robot, 1), next));
    }
    EXPECT_NEAR(q[1], east, 1e-4);
    EXPECT_LE(model.lowerBound(&state, 1).value, model.upperBound(state) + 1e-4);
  }
}

TEST(LaserTagBelief, IsBayesRule) {
  const LaserTag model = floor(2, 3);
  LaserTagBelief belief(model);
  Random random(2);
  State truth = model.initialState(random);
  std::vector<double> expected(36, 1.0 / 36);
  for (int step = 0; step < 12; ++step) {
    const int action = random.below(4);
    const Observation seen = model.step(truth, action, random.uniform()).observation;
    std::vector<double> next(36, 0.0);
    double total = 0.0;
    for (int robot = 0; robot < 6; ++robot) {
      for (int opponent = 0; opponent < 6; ++opponent) {
        const auto p = model.flight(robot, opponent);
        for (int to = 0; to < 6; ++to) {
          const int moved = model.neighbour(robot, action);
          const double share = expected[static_cast<std::size_t>(6 * robot + opponent)] *
                               p[static_cast<std::size_t>(to)] *
                               model.observationProbability(at(moved, to), action, seen);
          next[static_cast<std::size_t>(6 * moved + to)] += share;
          total += share;
        }
      }
    }
    EXPECT_EQ(belief.update(action, seen), UpdateStatus::OK);
    for (std::size_t i = 0; i < next.size(); ++i) {
      expected[i] = next[i] / total;
      EXPECT_NEAR(belief.weights()[i], expected[i], 1e-9);
    }
  }
}

TEST(LaserTagBelief, AnImpossibleObservationIsCountedAndSurvived) {
  const LaserTag model;
  LaserTagBelief belief(model);
  Observation too_far = 0;
  for (int beam = 0; beam < LaserTag::NUM_BEAMS; ++beam) too_far = withReading(too_far, beam, 15);
  EXPECT_EQ(belief.update(0, too_far), UpdateStatus::RECOVERED);
  EXPECT_EQ(belief.recoveries(), 1U);
  double sum = 0.0;
  for (const double weight : belief.weights()) sum += weight;
  EXPECT_NEAR(sum, 1.0, 1e-9);
  belief.reset(0);
  EXPECT_EQ(belief.recoveries(), 0U);
}

TEST(LaserTagBelief, SamplesInProportion) {
  const LaserTag model = floor(2, 2);
  LaserTagBelief belief(model);
  belief.update(0, LaserTag::SAME_CELL);
  std::vector<State> states(1000);
  Random random(1);
  belief.sample(random, 1000, states.data());
  std::vector<double> share(16, 0.0);
  for (const State& state : states) {
    share[static_cast<std::size_t>(4 * state.robot + state.opponent)] += 1e-3;
  }
  for (std::size_t i = 0; i < share.size(); ++i) {
    EXPECT_NEAR(share[i], belief.weights()[i], 2e-3);
  }
}

TEST(LaserTag, DespotCatchesTheOpponent) {
  const LaserTag model;
  DespotOptions options;
  options.deadline = 1e6;
  options.scenarios = 200;
  options.regularisation = 1.0;
  options.max_nodes = 50;
  Despot<LaserTag> planner(model, options);
  const EpisodeSummary summary = summarise(runEpisodes(model, planner, 60, 1));
  EXPECT_GT(summary.discounted, -10.5);  // -8.6 in the long run, +- 0.75 over 60 episodes
  EXPECT_EQ(summary.recoveries, 0U);
}

TEST(LaserTag, RefusesFloorsThatCannotBe) {
  const auto refusal = [](auto change) {
    LaserTagOptions options;
    change(options);
    return testing::refusal([&] { LaserTag{options}; });
  };
  EXPECT_NE(refusal([](auto& o) { o.rows = 0; }).find("0 x 11"), std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.obstacles = 76; }).find("76 obstacles"), std::string::npos);
  EXPECT_NE(refusal([](auto& o) { o.sigma = std::nan(""); }).find("sigma is nan"),
            std::string::npos);
}

TEST(Tiger, ObservationProbabilitiesMatchFrequencies) {
  const Tiger model;
  Random random(11);
  for (const int action : {0, 1, 2}) {
    for (const Tiger::State start : {Tiger::LEFT, Tiger::RIGHT}) {
      std::map<std::pair<int, int>, int> count;
      for (int k = 0; k < 10000; ++k) {
        Tiger::State state = start;
        const Step step = model.step(state, action, random.uniform());
        ++count[{state, static_cast<int>(step.observation)}];
      }
      for (const Tiger::State next : {Tiger::LEFT, Tiger::RIGHT}) {
        double sum = 0.0;
        for (const int seen : {0, 1}) {
          const double moved = action == Tiger::LISTEN ? (next == start ? 1.0 : 0.0) : 0.5;
          const double p =
              model.observationProbability(next, action, static_cast<Observation>(seen));
          const double found = count[std::make_pair(static_cast<int>(next), seen)];
          EXPECT_NEAR(found / 10000, moved * p, 0.02);
          sum += p;
        }
        EXPECT_NEAR(sum, 1.0, 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace fabric::planner::examples

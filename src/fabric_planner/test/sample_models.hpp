// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <random>
#include <string>

#include "fabric_planner/pomdp.hpp"

namespace fabric::planner::testing {

/// States s0.., actions a0.., observations o0..; tables to be filled in.
inline PomdpTables blankTables(int states, int actions, int observations, double discount) {
  PomdpTables tables;
  tables.name = "test";
  tables.discount = discount;
  for (int i = 0; i < states; ++i) tables.states.push_back("s" + std::to_string(i));
  for (int i = 0; i < actions; ++i) tables.actions.push_back("a" + std::to_string(i));
  for (int i = 0; i < observations; ++i) tables.observations.push_back("o" + std::to_string(i));
  tables.T.assign(static_cast<size_t>(actions), Eigen::MatrixXd::Zero(states, states));
  tables.O.assign(static_cast<size_t>(actions), Eigen::MatrixXd::Zero(states, observations));
  tables.R = Eigen::MatrixXd::Zero(actions, states);
  tables.initial_belief = Eigen::VectorXd::Unit(states, 0);
  return tables;
}

/// A random distribution; about `zeros` of its entries are zero, never all of them.
inline Eigen::RowVectorXd randomRow(std::mt19937& random, int size, double zeros) {
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Eigen::RowVectorXd row(size);
  for (int i = 0; i < size; ++i) row(i) = uniform(random) < zeros ? 0.0 : uniform(random);
  if (row.sum() < 1e-3) row(static_cast<int>(random() % static_cast<unsigned>(size))) = 1.0;
  return row / row.sum();
}

inline PomdpTables randomTables(std::mt19937& random, int states, int actions, int observations,
                                double discount, double zeros = 0.0) {
  PomdpTables tables = blankTables(states, actions, observations, discount);
  std::uniform_real_distribution<double> reward(-1.0, 1.0);
  for (int a = 0; a < actions; ++a) {
    for (int s = 0; s < states; ++s) {
      tables.T[static_cast<size_t>(a)].row(s) = randomRow(random, states, zeros);
      tables.O[static_cast<size_t>(a)].row(s) = randomRow(random, observations, zeros);
      tables.R(a, s) = reward(random);
    }
  }
  tables.initial_belief = randomRow(random, states, 0.0).transpose();
  return tables;
}

inline std::shared_ptr<const Pomdp> randomPomdp(std::mt19937& random, int states, int actions,
                                                int observations, double discount,
                                                double zeros = 0.0) {
  return std::make_shared<Pomdp>(
      randomTables(random, states, actions, observations, discount, zeros));
}

/// Something is worth 1 with probability p ("good") and -2 otherwise; everything but looking ends
/// it. "take" gets it, "leave" gets 0, "look" costs 0.1 and shows which it is. Discount 0.9.
/// By hand: V(p) = max(leave 0, take 3 p - 2, look -0.1 + 0.9 p).
inline std::shared_ptr<const Pomdp> takeLeaveLook(double p) {
  PomdpTables tables = blankTables(3, 3, 3, 0.9);
  tables.states = {"good", "bad", "end"};
  tables.actions = {"take", "leave", "look"};
  tables.observations = {"is_good", "is_bad", "nothing"};
  for (int a = 0; a < 2; ++a) {
    tables.T[static_cast<size_t>(a)].col(2).setOnes();
    tables.O[static_cast<size_t>(a)].col(2).setOnes();
  }
  tables.T[2].setIdentity();
  tables.O[2].setIdentity();
  tables.R.row(0) << 1.0, -2.0, 0.0;
  tables.R.row(2) << -0.1, -0.1, 0.0;
  tables.initial_belief << p, 1.0 - p, 0.0;
  return std::make_shared<Pomdp>(tables);
}

/// The words of the ModelError that `call` throws; empty when it throws none.
template <typename Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const ModelError& error) {
    return error.what();
  }
  return "";
}

}  // namespace fabric::planner::testing

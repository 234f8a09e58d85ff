// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "fabric_planner/lint.hpp"
#include "fabric_planner/policy_file.hpp"
#include "fabric_planner/pomdp_file.hpp"
#include "fabric_planner/pomdpx.hpp"

/// What each fuzzer does with its input: read it, and if it is accepted, check what the reader
/// promises. Anything but a ModelError is a fault. Shared with the ordinary tests.
namespace fabric::planner::fuzzing {

/// Small enough that no input takes long or much memory.
inline FileLimits tightLimits() {
  FileLimits limits;
  limits.values = 32;
  limits.entries = 6000;
  return limits;
}

inline void require(bool promise) {
  if (!promise) std::abort();
}

/// A model once accepted has rows that sum to 1, and lint has an opinion of it.
inline void checkModel(const Pomdp& model) {
  for (int a = 0; a < model.numActions(); ++a) {
    const Eigen::VectorXd T = model.T(a) * Eigen::VectorXd::Ones(model.numStates());
    const Eigen::VectorXd O = model.O(a) * Eigen::VectorXd::Ones(model.numObservations());
    require((T.array() - 1.0).abs().maxCoeff() < 1e-9);
    require((O.array() - 1.0).abs().maxCoeff() < 1e-9);
  }
  require(model.R().allFinite());
  (void)lint(model);
}

/// True when the input was accepted.
inline bool readPomdpx(std::string_view bytes, bool normalise) {
  try {
    checkModel(parsePomdpx(bytes, "fuzz", normalise, tightLimits()));
    return true;
  } catch (const ModelError&) {
    return false;
  }
}

inline bool readPomdp(std::string_view bytes, bool normalise) {
  try {
    checkModel(parsePomdpFile(bytes, "fuzz", normalise, tightLimits()));
    return true;
  } catch (const ModelError&) {
    return false;
  }
}

inline bool readPolicy(std::string_view bytes, const Pomdp& model) {
  try {
    const auto policy = parsePolicy(bytes, model, tightLimits());
    require(policy.vectors.allFinite() && policy.vectors.cols() == model.numStates());
    require(policy.vectors.rows() == static_cast<Eigen::Index>(policy.actions.size()));
    for (const int action : policy.actions) require(action >= 0 && action < model.numActions());
    return true;
  } catch (const ModelError&) {
    return false;
  }
}

/// Six states of which a third is seen: policies of mixed observability fit too.
inline Pomdp policyModel() {
  PomdpTables tables;
  tables.name = "fuzz";
  tables.states = {"l/u", "l/d", "m/u", "m/d", "r/u", "r/d"};
  tables.actions = {"stay", "go"};
  tables.observations = {"l", "m", "r"};
  tables.T.assign(2, Eigen::MatrixXd::Constant(6, 6, 1.0 / 6.0));
  tables.O.assign(2, Eigen::MatrixXd::Zero(6, 3));
  for (auto& O : tables.O) {
    for (int s = 0; s < 6; ++s) O(s, s / 2) = 1.0;
  }
  tables.R = Eigen::MatrixXd::Zero(2, 6);
  tables.discount = 0.9;
  tables.initial_belief = Eigen::VectorXd::Constant(6, 1.0 / 6.0);
  return Pomdp(tables);
}

}  // namespace fabric::planner::fuzzing

// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fabric_planner/model_file.hpp"
#include "fabric_planner/pomdp.hpp"
#include "factor.hpp"

namespace fabric::planner {

struct Variable {
  std::string name;      ///< for a state: after the step
  std::string previous;  ///< for a state: before the step; empty otherwise
  std::shared_ptr<const Domain> domain;
  bool fully_observed = false;
};

/// A POMDPX model as the file gives it, variable by variable.
struct FactoredModel {
  std::string name;
  double discount = 0.0;
  std::vector<Variable> actions;
  std::vector<Variable> states;
  std::vector<Variable> observations;
  std::vector<std::string> rewards;  ///< names of the reward variables
  std::vector<Factor> initial;       ///< P(s_i | other s)
  std::vector<Factor> transition;    ///< P(s'_i | a, s, other s')
  std::vector<Factor> observation;   ///< P(o_i | a, s', other o)
  std::vector<Factor> reward;        ///< summed
};

/// Multiplies the variables out into one table each (the product of values, first slowest).
/// Only what is not zero is ever looked at.
/// @throw ModelError when the tables would be too large, or variables depend on each other in a
/// circle.
SparseTables flatten(const FactoredModel& model, const FileLimits& limits);

}  // namespace fabric::planner

// SPDX-License-Identifier: BSD-3-Clause
#include "fabric_planner/despot.hpp"

#include <cmath>
#include <string>

namespace fabric::planner {
namespace {

void require(bool good, const char* name, double value, const char* expected) {
  if (good) return;
  throw ModelError(std::string("DESPOT option ") + name + " is " + std::to_string(value) +
                   ", expected " + expected);
}

}  // namespace

DespotOptions checked(DespotOptions options) {
  const auto notNegative = [](double value) { return std::isfinite(value) && value >= 0.0; };
  require(notNegative(options.deadline), "deadline", options.deadline, "a finite number >= 0");
  require(notNegative(options.gap), "gap", options.gap, "a finite number >= 0");
  require(notNegative(options.regularisation), "regularisation", options.regularisation,
          "a finite number >= 0");
  require(options.target >= 0.0 && options.target < 1.0, "target", options.target,
          "0 <= target < 1");
  require(options.max_nodes >= 0, "max_nodes", options.max_nodes, ">= 0");
  require(options.scenarios >= 1, "scenarios", options.scenarios, ">= 1");
  require(options.depth >= 1, "depth", options.depth, ">= 1");
  return options;
}

}  // namespace fabric::planner

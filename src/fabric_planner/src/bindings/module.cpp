// SPDX-License-Identifier: BSD-3-Clause
#include "bindings.hpp"

PYBIND11_MODULE(_core, module) {
  module.doc() = "Planner core of FABRIC (C++); use `import fabric_planner`.";
  fabric::planner::bindPomdp(module);
  fabric::planner::bindFiles(module);
  fabric::planner::bindSolvers(module);
  fabric::planner::bindPlanner(module);
  fabric::planner::bindEvaluate(module);
  fabric::planner::bindGenerative(module);
  fabric::planner::bindDecision(module);
  fabric::planner::bindMotion(module);
}

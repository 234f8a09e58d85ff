// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/pybind11.h>

namespace fabric::planner {

// One function a binding file; each adds its classes to the module.
void bindPomdp(pybind11::module_& module);
void bindFiles(pybind11::module_& module);
void bindSolvers(pybind11::module_& module);
void bindPlanner(pybind11::module_& module);
void bindEvaluate(pybind11::module_& module);
void bindGenerative(pybind11::module_& module);
void bindDecision(pybind11::module_& module);
void bindMotion(pybind11::module_& module);

}  // namespace fabric::planner

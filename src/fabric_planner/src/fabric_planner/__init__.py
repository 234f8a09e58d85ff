# SPDX-License-Identifier: BSD-3-Clause
"""The decision of FABRIC: tabular POMDPs, beliefs, bounds and an anytime planner."""

from fabric_planner._core import (
    BeliefFilter,
    Decision,
    EndedBy,
    MdpSolution,
    ModelError,
    OnlinePlanner,
    PlannerOptions,
    Pomdp,
    UpdateStatus,
    blind_bound,
    fast_informed_bound,
    load_pomdpx,
    point_based_bound,
    qmdp,
    save_pomdpx,
    solve_mdp,
    solve_mdp_arrays,
)

__all__ = [
    "BeliefFilter",
    "Decision",
    "EndedBy",
    "MdpSolution",
    "ModelError",
    "OnlinePlanner",
    "PlannerOptions",
    "Pomdp",
    "UpdateStatus",
    "blind_bound",
    "fast_informed_bound",
    "load_pomdpx",
    "point_based_bound",
    "qmdp",
    "save_pomdpx",
    "solve_mdp",
    "solve_mdp_arrays",
]

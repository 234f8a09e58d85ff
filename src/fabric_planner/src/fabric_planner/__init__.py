# SPDX-License-Identifier: BSD-3-Clause
"""The decision of FABRIC: tabular POMDPs, beliefs, bounds and an anytime planner."""

from fabric_planner._core import (
    BeliefFilter,
    ModelError,
    Pomdp,
    UpdateStatus,
    load_pomdpx,
    save_pomdpx,
)

__all__ = [
    "BeliefFilter",
    "ModelError",
    "Pomdp",
    "UpdateStatus",
    "load_pomdpx",
    "save_pomdpx",
]

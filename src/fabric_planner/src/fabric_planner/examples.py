# SPDX-License-Identifier: BSD-3-Clause
"""The example models of the literature, in C++."""

from __future__ import annotations

from fabric_planner import _core


def tiger() -> _core.CompiledModel:
    """Tiger (Kaelbling, Littman & Cassandra 1998): 2 states, 3 actions."""
    return _core._tiger()


def tag() -> _core.CompiledModel:
    """Tag (Pineau, Gordon & Thrun 2003): 870 states, 5 actions, 30 observations."""
    return _core._tag()


def rock_sample(n: int, k: int) -> _core.CompiledModel:
    """RockSample(n, k) (Smith & Simmons 2004): n x n cells, k rocks, 5 + k actions.

    Raises ModelError for sizes out of range.
    """
    return _core._rock_sample(n, k)


def laser_tag(
    layout_seed: int = 1, sigma: float = 2.5, symmetric: bool = False
) -> _core.CompiledModel:
    """LaserTag (Ye et al. 2017): 4,830 states, 5 actions, eight noisy beams.

    layout_seed places the 8 obstacles; sigma: noise of a beam in cells; symmetric: readings fall
    on both sides of the true distance, by default they only stop short of it.
    """
    return _core._laser_tag(layout_seed, sigma, symmetric)

# SPDX-License-Identifier: BSD-3-Clause
"""Settings of the classifier."""

from dataclasses import dataclass

from fabric_msgs.settings import check_settings, setting


@dataclass(frozen=True)
class HmmSettings:
    """One class' GMM-HMM and how it is trained. Raises ValueError naming a bad value."""

    states: int = setting(6, "1", 1, 40, "hidden states")
    mixtures: int = setting(3, "1", 1, 10, "Gaussians a state, diagonal")
    left_right: bool = True  # else every state may follow every state (ergodic)
    variance_floor: float = setting(
        0.05, "1", 1e-6, 1.0, "least variance, in units of the feature's over all data"
    )
    dither: float = setting(
        0.05, "1", 0.0, 1.0, "Gaussian noise on training data, in standard deviations"
    )
    iterations: int = setting(8, "1", 1, 200, "of expectation-maximisation at most")
    tolerance: float = setting(1e-3, "nat/frame", 0.0, 1.0, "gain below which training ends")
    retries: int = setting(3, "1", 0, 20, "more seeds to try when training fails its checks")

    def __post_init__(self) -> None:
        if not isinstance(self.left_right, bool):
            raise ValueError(f"left_right is {self.left_right!r}; it must be true or false")
        check_settings(self)


@dataclass(frozen=True)
class ContextSettings:
    """What a frame is looked at together with, and how that is boiled down.

    lags: frames before each, from 0 up. The frames together are projected to the `dimensions` in
    which classes, and the parts of a gesture, differ most (linear discriminants); 0 leaves them all
    and only scales them. Raises ValueError naming a bad value.
    """

    lags: tuple[int, ...] = (0, 1, 2, 4, 7)
    dimensions: int = setting(12, "1", 0, 200, "to project to; 0 projects not at all")
    parts: int = setting(5, "1", 1, 20, "of a gesture that are to be told apart")

    def __post_init__(self) -> None:
        check_settings(self)
        whole = all(isinstance(lag, int) and not isinstance(lag, bool) for lag in self.lags)
        if (
            not whole
            or not self.lags
            or self.lags[0] != 0
            or sorted(set(self.lags)) != list(self.lags)
        ):
            raise ValueError(f"lags are {self.lags!r}; they must be whole numbers from 0 up")


PLAIN = ContextSettings(lags=(0,), dimensions=0)  # every frame alone


@dataclass(frozen=True)
class ScoreSettings:
    """How frames are weighed when classes are compared. Raises ValueError naming a bad value."""

    evidence_weight: float = setting(
        0.12,
        "1",
        1e-3,
        1.0,
        "exponent of a frame's likelihood: frames in a row are not independent",
    )
    garbage_offset: float = setting(
        -2.0, "nat/frame", -50.0, 50.0, "how much worse than the background a gesture may score"
    )
    garbage_spread: float = setting(
        2.0, "1", 1.0, 20.0, "standard deviation of the background, in those of all data"
    )
    interruption: float = setting(
        0.005, "1/frame", 1e-6, 0.5, "least probability that a gesture ends, whatever its state"
    )
    late_entry: float = setting(
        0.05, "1", 0.0, 1.0, "share of gestures that are first seen in the middle"
    )

    def __post_init__(self) -> None:
        check_settings(self)

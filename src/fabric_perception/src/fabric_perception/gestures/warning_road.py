# SPDX-License-Identifier: BSD-3-Clause
"""The fast road of a warning: told at the first frame that makes it likely enough."""

from typing import Any

from fabric_perception.gestures.recording import WARN
from fabric_perception.gestures.scoring import StreamingScore


class WarningRoad:
    """Tells of each warning once, without waiting for frames to agree.

    Has a score of its own, so that evidence and delay can be weighed otherwise than where gestures
    are told apart. Shiryaev's rule: tell when the posterior of a warning reaches
    `threshold`; the next one can only be told after it has fallen below `rearm`.
    """

    def __init__(self, score: StreamingScore, threshold: float = 0.9, rearm: float = 0.5) -> None:
        """Raises ValueError unless 0 < rearm <= threshold < 1."""
        if not 0.0 < rearm <= threshold < 1.0:
            raise ValueError(
                f"threshold is {threshold} and rearm {rearm}; 0 < rearm <= threshold < 1 is needed"
            )
        self._score = score
        self._threshold, self._rearm = threshold, rearm
        self._told = False

    def reset(self) -> None:
        """Forget everything, also a warning that was told."""
        self._score.reset()
        self._told = False

    def step(self, frame: Any | None) -> bool:
        """Take a frame (D,), None where nothing was seen; True when a warning is to be told now."""
        warning = float(self._score.step(frame)[WARN])
        if self._told:
            self._told = warning >= self._rearm
            return False
        self._told = warning >= self._threshold
        return self._told

# SPDX-License-Identifier: BSD-3-Clause
"""Which of several poses it is: by their errors, by what was seen before, by how heads are held.

Each pose of a picture carries the cost of the cheapest story that ends with it (Viterbi): minus
the logarithm of its likelihood, up to a constant. A wrong pose that fits one picture by chance is
given up when the stories of later pictures are cheaper without it.
"""

from collections.abc import Sequence

import numpy as np

from fabric_perception.head.parameters import HeadParameters
from fabric_perception.head.pose import Candidate, angle_between

COORDINATES = 8  # of a marker's four corners
FORGET = 25.0  # largest difference of two stories that is remembered; e^25 : 1
JUMP = 8.0  # cost of a head that jumps: never more, so that a wrong beginning is overcome
STILL = 0.05  # rad, by which a pose of a head that does not move differs from picture to picture


class Continuity:
    """Chooses one candidate a picture. up: (3,) the cell's z axis in the camera's frame."""

    def __init__(self, parameters: HeadParameters, up: np.ndarray) -> None:
        self._parameters = parameters
        self._up = up
        self.reset()

    def reset(self) -> None:
        """Forget what was seen."""
        self._time = -np.inf
        self._stories: list[tuple[np.ndarray, float]] = []  # rotation (3, 3), cost

    def choose(self, t: float, found: Sequence[Candidate]) -> Candidate:
        """Return the likeliest of one or more candidates at time t (s), later than before."""
        if t - self._time > self._parameters.memory:
            self._stories = []
        costs = self._errors(found)
        for number, candidate in enumerate(found):
            costs[number] += self._leaning(candidate) + self._way(t, candidate)
        costs = np.minimum(costs - costs.min(), FORGET)
        self._stories = [(c.pose[:3, :3], cost) for c, cost in zip(found, costs, strict=True)]
        self._time = t
        return found[int(np.argmin(costs))]

    def _errors(self, found: Sequence[Candidate]) -> np.ndarray:
        """Half the sum of squared corner errors over their variance, as estimated by the best."""
        squares = np.array([c.error**2 for c in found])
        corners = np.array([len(c.ids) * COORDINATES / 2 for c in found])
        variance = max(self._parameters.corner_noise**2, float(squares.min()) / 2.0)
        return corners * squares / (2.0 * variance)

    def _leaning(self, candidate: Candidate) -> float:
        lean = np.arccos(np.clip(candidate.pose[:3, 2] @ self._up, -1.0, 1.0))
        return 0.5 * float(lean / self._parameters.upright) ** 2

    def _way(self, t: float, candidate: Candidate) -> float:
        """Cost of the cheapest story before, with the turn from its end to the candidate."""
        if not self._stories:
            return 0.0
        spread = STILL + self._parameters.turn_rate * (t - self._time)
        return min(
            cost + min(0.5 * (angle_between(R, candidate.pose[:3, :3]) / spread) ** 2, JUMP)
            for R, cost in self._stories
        )

# SPDX-License-Identifier: BSD-3-Clause
"""A point that moves evenly except for random pushes: cv2.KalmanFilter with six states.

State (x, y, z, vx, vy, vz) in m and m/s, frame cell. Discrete white noise acceleration: over a
step dt a push of `push` m/s^2 (standard deviation) adds push^2 [dt^4/4, dt^3/2; dt^3/2, dt^2] to
position and velocity of each axis.
"""

import math

import cv2
import numpy as np

POSITION, VELOCITY = slice(0, 3), slice(3, 6)
SLOWEST = 1.0  # m/s, standard deviation of the velocity of something seen once


class PointFilter:
    """Position (3,) and velocity (3,) of one point."""

    def __init__(self, t: float, position: np.ndarray, sigma: float, push: float) -> None:
        """t: s. position: (3,) m, as measured with standard deviation `sigma` m. push: m/s^2."""
        self._filter = cv2.KalmanFilter(6, 3, 0, cv2.CV_64F)
        self._push = push
        self._transition = np.eye(6)
        # OpenCV keeps these arrays, so that a new dt is written in place
        self._filter.transitionMatrix = self._transition
        self._noise = np.zeros((6, 6))
        self._filter.processNoiseCov = self._noise
        self._filter.measurementMatrix = np.eye(3, 6)
        self._measured = np.zeros((3, 3))
        self._filter.measurementNoiseCov = self._measured
        self._dt = self._sigma = 0.0
        self._axes = np.arange(3)
        self.reset(t, position, sigma)

    def reset(
        self, t: float, position: np.ndarray, sigma: float, velocity: np.ndarray | None = None
    ) -> None:
        """Forget the past: at `position` (3,) m at t s, with `velocity` (3,) m/s if known."""
        self.t = t
        state = np.zeros(6)
        state[POSITION] = position
        spread = SLOWEST
        if velocity is not None:
            state[VELOCITY], spread = velocity, 0.1
        # a copy for each: predict and correct write into these arrays
        covariance = np.diag([sigma**2] * 3 + [spread**2] * 3)
        self._filter.statePost, self._filter.statePre = state.copy(), state.copy()
        self._filter.errorCovPost, self._filter.errorCovPre = covariance, covariance.copy()
        self._state = state

    @property
    def position(self) -> np.ndarray:
        """(3,) m."""
        return self._state[POSITION].copy()

    @property
    def velocity(self) -> np.ndarray:
        """(3,) m/s."""
        return self._state[VELOCITY].copy()

    @property
    def spread(self) -> float:
        """Standard deviation of the position along one axis, m."""
        return math.sqrt(max(0.0, float(self._filter.errorCovPost[0, 0])))

    def predict(self, t: float) -> np.ndarray:
        """Go on to time t (s); return the position (3,) m expected there."""
        dt = t - self.t
        if dt <= 0.0:
            return self.position
        if dt != self._dt:
            self._set_step(dt)
        self._state = self._filter.predict().ravel()
        self.t = t
        return self.position

    def correct(self, position: np.ndarray, sigma: float) -> None:
        """Take a measurement (3,) m of standard deviation `sigma` m, once after each `predict`."""
        if sigma != self._sigma:
            self._sigma = sigma
            self._measured[self._axes, self._axes] = sigma**2
        self._state = self._filter.correct(position).ravel()

    def stop(self) -> None:
        """Let it stand where it is."""
        self.reset(self.t, self.position, self.spread, np.zeros(3))

    def _set_step(self, dt: float) -> None:
        at = self._axes
        self._dt = dt
        self._transition[at, at + 3] = dt
        variance = self._push**2
        self._noise[at, at] = variance * dt**4 / 4.0
        self._noise[at, at + 3] = self._noise[at + 3, at] = variance * dt**3 / 2.0
        self._noise[at + 3, at + 3] = variance * dt**2

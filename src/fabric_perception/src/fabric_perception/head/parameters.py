# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the head tracker: one place for unit, range and default."""

from dataclasses import dataclass

from fabric_msgs.settings import check_settings, setting


@dataclass(frozen=True)
class HeadParameters:
    """How pictures become poses, and poses looks; raises ValueError naming a bad value."""

    window: int = setting(23, "pixels", 3, 99, "odd; of the one adaptive threshold")
    corner_noise: float = setting(
        0.8, "pixels", 0.01, 10.0, "of a corner of a moving head, in the choice between two poses"
    )
    largest_error: float = setting(
        4.0, "pixels", 0.1, 50.0, "root mean square of a pose's corners; one above is no pose"
    )
    turn_rate: float = setting(
        3.0, "rad/s", 0.1, 50.0, "how fast a head turns, in the choice by continuity"
    )
    upright: float = setting(0.5, "rad", 0.05, 3.0, "how far a head leans, as a rule")
    memory: float = setting(
        1.0, "s", 0.05, 10.0, "a head not seen for so long is a head never seen"
    )
    search_growth: float = setting(
        0.3, "1", 0.1, 10.0, "of the helmet's size in the picture, searched around where it was"
    )
    work_x: float = setting(0.30, "m", -5.0, 5.0, "middle of the work area, in frame cell")
    work_y: float = setting(0.0, "m", -5.0, 5.0, "middle of the work area, in frame cell")
    work_z: float = setting(0.10, "m", -5.0, 5.0, "middle of the work area, in frame cell")
    yaw_limit: float = setting(
        0.70, "rad", 0.05, 3.1, "a face further aside from the work area looks around"
    )
    pitch_limit: float = setting(
        0.95, "rad", 0.05, 1.6, "a face further above or below the work area looks around"
    )
    margin: float = setting(
        0.10, "rad", 0.0, 0.5, "further inside than the limits, a face is back at the work area"
    )
    look_frames: int = setting(
        2, "frames", 1, 50, "seen frames in a row before looking around begins or ends"
    )
    picture_age: float = setting(
        0.5, "s", 0.05, 10.0, "pictures older than this, or from the future, are not used"
    )

    def __post_init__(self) -> None:
        check_settings(self)
        if not self.window % 2:
            raise ValueError(f"window is {self.window}; it must be odd")
        if self.margin >= min(self.yaw_limit, self.pitch_limit):
            raise ValueError(f"margin is {self.margin}; it must be below both limits")

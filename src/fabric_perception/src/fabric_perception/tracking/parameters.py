# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the tracker: one place for unit, range and default."""

from dataclasses import dataclass

from fabric_msgs.settings import check_settings, setting


@dataclass(frozen=True)
class TrackingParameters:
    """How pictures become tracks; raises ValueError naming a bad value."""

    ground_margin: float = setting(
        0.008, "m", 0.0, 0.05, "pixels less than this above belt, table or container are ground"
    )
    least_area: int = setting(40, "pixels", 4, 5000, "smaller patches are noise")
    depth_share: float = setting(
        0.15, "1", 0.0, 1.0, "of a patch's pixels must have a depth, else its place is inferred"
    )
    cube_least: float = setting(
        0.35, "edges", 0.1, 1.0, "a patch narrower than this is no cube: side of an equal square"
    )
    cube_most: float = setting(
        1.5, "edges", 1.1, 3.0, "a wider one is several cubes in a container, and none elsewhere"
    )
    cube_noise: float = setting(
        0.003, "m", 1e-4, 0.05, "standard deviation of the place of a cube in full view"
    )
    cube_push: float = setting(
        0.5, "m/s^2", 0.01, 50.0, "how hard a cube on the belt may speed up (standard deviation)"
    )
    carried_push: float = setting(6.0, "m/s^2", 0.01, 50.0, "the same for a cube in a hand")
    gate: float = setting(0.9, "edges", 0.3, 3.0, "a cube may be so far from where it is expected")
    lift: float = setting(0.5, "edges", 0.2, 2.0, "a cube so far above its ground is carried")
    hand_reach: float = setting(
        0.09, "m", 0.02, 0.3, "from the middle of the glove to a cube it can hold"
    )
    cup_reach: float = setting(
        0.025,
        "m",
        0.005,
        0.1,
        "from the end of the suction cup to the middle of a cube it can hold",
    )
    contact_memory: float = setting(
        1.5, "s", 0.1, 10.0, "how long ago a hand or the cup may have been at a cube that is gone"
    )
    trail: float = setting(
        3.0, "s", 0.5, 10.0, "how far back along a carrier's way a released cube is looked for"
    )
    birth_pictures: int = setting(
        2, "pictures", 1, 20, "in a row in which a new cube must be seen before it gets a number"
    )
    rest_pictures: int = setting(
        2, "pictures", 1, 20, "in a row in which a released cube must be seen lying"
    )
    rest_speed: float = setting(0.05, "m/s", 0.001, 0.5, "slower is lying still")
    lost_after: float = setting(
        1.0, "s", 0.1, 10.0, "a cube missing this long from a place in view is not reported"
    )
    doubt_time: float = setting(
        5.0, "s", 0.1, 60.0, "confidence falls by 1/e for every such time out of view"
    )
    glove_area: tuple[float, float] = setting(
        (0.0030, 0.0300), "m^2", 1e-6, 1.0, "a smaller or larger yellow patch is no glove"
    )
    glove_length: tuple[float, float] = setting(
        (0.07, 0.30), "m", 0.001, 1.0, "the longer side of a glove"
    )
    glove_elongation: float = setting(
        4.0, "1", 1.0, 20.0, "a glove is at most so many times longer than wide"
    )
    glove_solidity: float = setting(
        0.55, "1", 0.0, 1.0, "a glove fills at least this share of its convex hull"
    )
    glove_height: float = setting(
        0.02, "m", 0.0, 0.3, "a glove's middle is at least so far above table, belt or container"
    )
    glove_relief: float = setting(
        0.004, "m", 0.0, 0.1, "a glove is not flat: spread of its heights, at least"
    )
    hand_noise: float = setting(
        0.006, "m", 1e-4, 0.1, "standard deviation of the measured place of the glove"
    )
    hand_push: float = setting(
        2.5, "m/s^2", 0.1, 100.0, "how hard a hand may speed up (standard deviation)"
    )
    hand_thickness: float = setting(
        0.02, "m", 0.0, 0.1, "from the seen side of the glove to its middle"
    )
    hand_gate: float = setting(
        0.35, "m", 0.05, 2.0, "a glove may be so far from where it is expected"
    )
    hand_lost: float = setting(
        0.5, "s", 0.05, 10.0, "a hand out of view this long is looked for anywhere"
    )
    step_delay: float = setting(
        2.5, "s", 0.1, 10.0, "a load cell tells of a cube at most so long after it was put down"
    )
    step_patience: float = setting(
        4.0, "s", 0.1, 30.0, "how long a load cell's step waits for the cube it belongs to"
    )
    unweighed_after: float = setting(
        4.0, "s", 0.1, 60.0, "a cube lying in a person's tray counts without a load cell after this"
    )
    stale_after: float = setting(0.5, "s", 0.01, 10.0, "older pictures are not used")

    def __post_init__(self) -> None:
        check_settings(self)

# SPDX-License-Identifier: BSD-3-Clause
"""What the cell sends, by topic; and what of it belongs to the arm's controller."""

from std_msgs.msg import Header

from fabric_msgs.msg import (
    ContainerArray,
    ConveyorState,
    CubeArray,
    GroundTruth,
    HeadState,
    HumanActivity,
)

COUNTED = {
    "truth": GroundTruth,
    "conveyor/state": ConveyorState,
    "cell/cubes": CubeArray,
    "cell/containers": ContainerArray,
    "human/warning": Header,
    "human/activity": HumanActivity,
    "human/head": HeadState,
}
LATCHED = ("cell/containers",)
RESULT, GOAL, CANCEL = "arm/move/result", "arm/move/goal", "arm/move/cancel"
DEVICES = ("conveyor/state", "arm/tcp", RESULT, GOAL, CANCEL)

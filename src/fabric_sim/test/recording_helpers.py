# SPDX-License-Identifier: BSD-3-Clause
"""Rows of recordings for the tests of what reads them; times in s, as numbers or text."""

from fabric_sim.experiments.trials import FLAGS


def seen(time, **flags):
    """An observation in which the person is there and these flags are up."""
    values = {"detected": "1", **{name: "1" for name in flags}}
    return {"time_s": time, "source": "observation", **{f: values.get(f, "0") for f in FLAGS}}


def robot(time, action):
    """The robot begins an action."""
    return {"time_s": time, "source": "robot", "robot_action": action}


def tray(time, status, who):
    """A cube is placed, rightly or not, by somebody."""
    return {"time_s": time, "source": "sensor", "subtask_status": status, "who": who}

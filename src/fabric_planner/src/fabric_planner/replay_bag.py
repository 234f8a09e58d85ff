# SPDX-License-Identifier: BSD-3-Clause
"""Our own bags as recordings; ROS' reader of bags is needed only when one is read."""

from pathlib import Path

from fabric_planner.replay import Recording, ReplayError, from_messages


def read_bag(path: "str | Path") -> Recording:
    """The topics observation and decision of a bag, in whatever namespace they were.

    Raises ReplayError naming the file.
    """
    import rosbag  # noqa: PLC0415

    path = Path(path)
    found: dict[str, list] = {"observation": [], "decision": [], "task/state": [], "model_info": []}
    try:
        with rosbag.Bag(str(path)) as bag:
            for topic, message, _ in bag.read_messages():
                for name, messages in found.items():
                    if topic == name or topic.endswith("/" + name):
                        messages.append(message)
    except (OSError, rosbag.ROSBagException) as error:
        raise ReplayError(f"{path}: cannot be read as a bag: {error}") from error
    scenario = next((state.scenario for state in found["task/state"] if state.scenario), "sorting")
    robot = found["model_info"][-1].name if found["model_info"] else "unknown"
    return from_messages(path.stem, found["observation"], found["decision"], scenario, robot)

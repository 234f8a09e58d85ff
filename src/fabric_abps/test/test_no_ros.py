# SPDX-License-Identifier: BSD-3-Clause
"""The core needs no ROS node library."""

import subprocess
import sys

BLOCKED = ("rospy", "roscpp", "rosbag", "actionlib", "tf2_ros", "fabric_sim")


def test_core_imports_with_ros_blocked() -> None:
    block = "".join(f"sys.modules[{name!r}] = None; " for name in BLOCKED)
    code = f"import sys; {block}import fabric_abps"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr

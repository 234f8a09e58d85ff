# SPDX-License-Identifier: BSD-3-Clause
"""The experiment: tasks, scores and the record of a run. The modules know no ROS."""

from fabric_msgs.compiled import use

use(__name__, __path__)

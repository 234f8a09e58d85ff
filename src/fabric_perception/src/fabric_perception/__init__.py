# SPDX-License-Identifier: BSD-3-Clause
"""What is seen in the cell, and when it is worth a decision. The modules know no ROS."""

from fabric_msgs.compiled import use

use(__name__, __path__)

# SPDX-License-Identifier: BSD-3-Clause
"""The pretend cell: simulated workers, conveyor, arm and sensors."""

from fabric_msgs.compiled import use

use(__name__, __path__)

# SPDX-License-Identifier: BSD-3-Clause
"""The pretend cell: simulated workers, conveyor, arm and sensors."""

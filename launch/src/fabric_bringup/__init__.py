# SPDX-License-Identifier: BSD-3-Clause
"""What starts, checks and shows a whole FABRIC graph; no ROS client library in here."""

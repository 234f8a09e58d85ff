#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The emulated arm for launch files; roslaunch's own words are left out."""

import sys

import rospy

from fabric_dobot_driver.emulator.__main__ import main

if __name__ == "__main__":
    sys.exit(main(rospy.myargv()[1:]))

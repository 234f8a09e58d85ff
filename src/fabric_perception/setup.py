# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

PARTS = ("", ".calibration", ".gestures", ".head", ".tracking")

setup(
    **generate_distutils_setup(
        packages=["fabric_perception" + part for part in PARTS], package_dir={"": "src"}
    )
)

# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=["fabric_sim", "fabric_sim.camera", "fabric_sim.experiments"],
        package_dir={"": "src"},
    )
)

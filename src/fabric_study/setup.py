# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

packages = ["fabric_study", "fabric_study.statistics", "fabric_study.web"]
setup(**generate_distutils_setup(packages=packages, package_dir={"": "src"}))

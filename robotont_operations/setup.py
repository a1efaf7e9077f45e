"""Read by catkin: where the Python package lies."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["robotont_operations", "robotont_operations.network_check"],
                                 package_dir={"": "src"}))

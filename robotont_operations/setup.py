"""Read by catkin: where the Python package lies."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["robotont_operations"], package_dir={"": "src"}))

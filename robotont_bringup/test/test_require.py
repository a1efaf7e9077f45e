"""`require`: its words, its exit status, and that it ends nobody but itself."""

import subprocess
import sys

import pytest

from robotont_bringup.require import words


@pytest.mark.parametrize("packages, debian, expected", [
    (["x", "y"], "ros-noetic-z", "a.launch needs the ROS packages x, y, which are missing: sudo apt-get install "
                                 "ros-noetic-z (ROS Noetic; Debian itself has none)"),
    (["robotont_x"], None, "a.launch needs the ROS package robotont_x, which is missing: build it in this workspace"),
])
def test_words(packages, debian, expected):
    assert words("a.launch", packages, debian) == expected


def test_who_asks_lives_on_and_gets_an_error():
    program = ("import roslaunch.config\n"
               "def load(package):\n"
               "    roslaunch.config.load_config_default([], None, ['<launch><param name=\"x\" "
               "command=\"rosrun robotont_bringup require here ' + package + '\"/></launch>'])\n"
               "load('robotont_bringup')\n"
               "try:\n"
               "    load('no_such_package')\n"
               "except roslaunch.core.RLException as error:\n"
               "    print('caught', error)\n")
    result = subprocess.run([sys.executable, "-c", program], check=False, text=True, timeout=60, capture_output=True)
    assert result.returncode == 0, result.stderr
    assert "here needs the ROS package no_such_package" in result.stderr
    assert "returned with code [1]" in result.stdout

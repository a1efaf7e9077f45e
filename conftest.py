"""Lets pytest run rostests: each .test file is one test, with a ROS master of its own.

Tests whose bounds are in real time are marked `timed`, rostests by a name timed_*.test: `./robotont test` runs them
alone, after all others.
"""

import os
import subprocess

import pytest


def pytest_collect_file(file_path, parent):
    """Take .test files."""
    if file_path.suffix == ".test":
        return RostestFile.from_parent(parent, path=file_path)
    return None


class RostestFile(pytest.File):
    """A launch file that rostest runs."""

    def collect(self):
        """One item; one for each way to start the driver's nodes where the file has the argument `composed`."""
        variants = {self.path.stem: ()}
        if '<arg name="composed"' in self.path.read_text():
            variants = {f"{self.path.stem}[one process]": ("composed:=true",),
                        f"{self.path.stem}[three processes]": ("composed:=false",)}
        for name, arguments in variants.items():
            rostest = Rostest.from_parent(self, name=name)
            rostest.arguments = arguments
            rostest.add_marker(pytest.mark.rostest)
            if self.path.name.startswith("timed_"):
                rostest.add_marker(pytest.mark.timed)
            yield rostest


class Rostest(pytest.Item):
    """A run of rostest."""

    arguments = ()

    def runtest(self):
        """Run it; all that it prints is shown when it fails."""
        environment = {**os.environ, "ROS_IP": "127.0.0.1"}
        environment.pop("ROS_MASTER_URI", None)
        environment.pop("ROS_HOSTNAME", None)
        result = subprocess.run(["rostest", str(self.path), *self.arguments], env=environment, check=False,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        if result.returncode:
            raise RostestError(result.stdout)

    def repr_failure(self, excinfo, style=None):
        """What rostest printed."""
        if isinstance(excinfo.value, RostestError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self):
        """Where it stands."""
        return self.path, None, "rostest " + self.name


class RostestError(Exception):
    """rostest ended with an error; holds what it printed."""

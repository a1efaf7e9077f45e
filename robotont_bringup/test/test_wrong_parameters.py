"""A node with wrong parameters lists every fault and exits with 1; it never drives with made-up ones."""

import re

import pytest
import yaml

from robotont_driver.kinematics.wheel_params import KEYS
from robotont_testing.harness import Master, wait_for
from robotont_testing.robots import WHEEL_PARAMS

GOOD = yaml.safe_load(WHEEL_PARAMS.read_text())
NO_ROBOT = "where no robot runs: start robot.launch"
# Debian 11's rospy, at the end of any node; docs/reference.md
ROSPY_ON_PYTHON_39 = re.compile(r"Traceback.*\n(  .*\n)*AttributeError: 'Thread' object has no attribute 'isAlive'")
# What is wrong in which way, the tests of robotont_driver show; here: each way to a node's end.
# {case: (node, parameters of its namespace, its arguments, words of the log)}
CASES = {
    "none": ("driver_node", {}, (), [NO_ROBOT]),
    "all wrong": ("driver_node", dict.fromkeys(KEYS, "?"), ("_cmd_timeout:=-1", "_publish_rat:=20.0"), [
        *(f"{key}: found '?', allowed: " for key in KEYS), "did you mean ~publish_rate?",
        "~cmd_timeout: found -1, allowed: a finite number from 0.05 to 2 [s]: for so long the"]),
    "a value for all": ("driver_node", {**GOOD, "driver_node": 20.0}, (), [
        "~: found 20.0, allowed: parameters by name"]),
}


@pytest.fixture(name="ended", scope="module")
def _ended():
    """{case: (exit status, log)}; all at once, each in a namespace of its own."""
    with Master() as master:
        nodes = {}
        for number, (case, (node, given, arguments, _)) in enumerate(CASES.items()):
            log = master.folder / f"{number}.log"
            master.load({"nothing": 0, **given}, f"/case{number}")
            nodes[case] = master.node(node, f"__ns:=/case{number}", *arguments, log=log), log
        wait_for(lambda: None not in [process.poll() for process, _ in nodes.values()], "their ends", 60.0, 0.1)
        yield {case: (process.returncode, log.read_text()) for case, (process, log) in nodes.items()}


@pytest.mark.parametrize("case", CASES)
def test_a_node_with_wrong_parameters(ended, case):
    status, log = ended[case]
    assert status == 1, log
    assert all(words in log for words in CASES[case][-1]), log
    assert "Traceback" not in ROSPY_ON_PYTHON_39.sub("", log)
    if case.startswith("none"):
        assert log.count("wrong parameter") == 1, log

#!/usr/bin/env python3
"""A node with wrong parameters lists every fault and exits with 1; it never drives with made-up ones."""


import rosnode
import rosparam
import rostest
import yaml

from robotont_driver.kinematics.wheels import KEYS
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.robots import WHEEL_PARAMS

NODES = ("driver_node", "serial_com_node", "odom_node", "mock_serial_node")


class WrongParametersTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.number = 0

    def run_node(self, node, wheels, *arguments):
        """(exit status, log) of a node that starts in a fresh namespace with these wheel parameters."""
        self.number += 1
        namespace = f"/{self.id().rpartition('.')[2]}_{self.number}"
        rosparam.set_param(namespace, yaml.safe_dump({"nothing": 0, **wheels}))
        log = self.processes.folder / "log"
        process = self.processes.node(node, f"__ns:={namespace}", *arguments, log=log)
        wait_for(lambda: process.poll() is not None, f"the end of {node}", timeout=30)
        return process.returncode, log.read_text()

    def test_every_node_needs_the_wheel_parameters(self):
        for node in NODES:
            status, log = self.run_node(node, {})
            self.assertEqual(status, 1, log)
            self.assertRegex(log, "found none in /.*, where no robot runs: start robot.launch")
            self.assertEqual(log.count("wrong parameter"), 1, log)
            self.assertNotIn("Traceback", log)

    def test_all_faults_are_listed_at_once(self):
        status, log = self.run_node(
            "driver_node", {key: "?" for key in KEYS}, "_cmd_timeout:=-1", "_publish_rat:=20.0")
        self.assertEqual(status, 1, log)
        for key in KEYS:
            self.assertIn(f"{key}: found '?', allowed: ", log)
        self.assertIn("~cmd_timeout: found -1, allowed: a finite number from 0.05 to 2 [s]: for so long the", log)
        self.assertIn("did you mean ~publish_rate?", log)

    def test_each_node_checks_its_own_parameters(self):
        good = yaml.safe_load(WHEEL_PARAMS.read_text())
        for node, argument, words in (
            ("driver_node", "_max_wheel_speed:=fast", "~max_wheel_speed: found 'fast'"),
            ("serial_com_node", "_packets:=maybe", "~packets: found 'maybe', allowed: one of auto, plain, checked"),
            ("odom_node", "_publish_tf:=5", "~publish_tf: found 5, allowed: true or false"),
            ("mock_serial_node", "_noise:=1", "~noise: no such parameter"),
        ):
            status, log = self.run_node(node, good, argument)
            self.assertEqual(status, 1, log)
            self.assertIn(words, log)

    def test_numbers_beyond_reason_are_refused_with_the_reason(self):
        good = yaml.safe_load(WHEEL_PARAMS.read_text())
        for node, wrong in (
            ("driver_node", {
                "_cmd_timeout:=500": "drives on when its commander dies", "_publish_rate:=1e6": "from 5 to 200 [Hz]",
                "_command_decimals:=60": "a whole number from 0 to 3",
                "_diagnostic_period:=0": "~diagnostic_period: found 0, allowed: a finite number from"}),
            ("serial_com_node", {
                "_write_timeout:=1e10": "drives on when driver_node dies"}),
        ):
            status, log = self.run_node(node, {**good, "wheelAmount": 2147483647}, *wrong)
            self.assertEqual(status, 1, log)
            for words in (*wrong.values(), "wheelAmount: found 2147483647, allowed: a whole number from 3 to 16"):
                self.assertIn(words, log)
            self.assertNotIn("Traceback", log)

    def test_a_value_where_parameters_should_be(self):
        good = yaml.safe_load(WHEEL_PARAMS.read_text())
        status, log = self.run_node("driver_node", {**good, "driver_node": 20.0})
        self.assertEqual(status, 1, log)
        self.assertIn("~: found 20.0, allowed: parameters by name", log)
        self.assertNotIn("Traceback", log)

    def test_nodes_are_checked_against_each_other(self):
        good = yaml.safe_load(WHEEL_PARAMS.read_text())
        for node, own, other in (("driver_node", "_publish_rate:=5.0", {"serial_com_node": {"write_timeout": 0.3}}),
                                 ("serial_com_node", "_write_timeout:=0.3", {"driver_node": {"publish_rate": 5.0}})):
            status, log = self.run_node(node, {**good, **other}, own)
            self.assertEqual(status, 1, log)
            self.assertIn("found a packet every 0.2 s and a stop after 0.3 s without one", log)

    def test_wheels_that_cannot_move_the_robot(self):
        good = yaml.safe_load(WHEEL_PARAMS.read_text())
        status, log = self.run_node("odom_node", {**good, "wheelRads": [0.5, 0.5, 0.5]})
        self.assertEqual(status, 1, log)
        self.assertIn("rank < 3", log)

    def test_nothing_is_left_behind(self):
        self.run_node("driver_node", {})
        self.assertFalse([name for name in rosnode.get_node_names() if "driver_node" in name])


if __name__ == "__main__":
    rostest.rosrun("robotont_bringup", "wrong_parameters_test", WrongParametersTest)

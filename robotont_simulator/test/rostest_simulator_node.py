#!/usr/bin/env python3
"""The unchanged driver on the simulator, through simulation.launch."""

import math
import time
from typing import ClassVar

import numpy as np
import rosparam
import rospy
import rostest
import yaml
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32, Float32MultiArray, Int8MultiArray
from std_srvs.srv import SetBool, Trigger

from robotont_driver.se2 import between, pose_of, wrap
from robotont_testing import places
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import ERROR, OK, WARN, NodeTest, twist
from robotont_testing.robots import WHEEL_PARAMS

LINK = "serial_com_node: link"
BOARD = "serial_com_node: board"


def pose(message):
    """(x, y, yaw) of an Odometry."""
    place = message.pose.pose
    return pose_of(place)


class Simulation(Processes):
    """simulation.launch with these arguments."""

    def __init__(self, *arguments):
        super().__init__()
        self.arguments = arguments
        self.log = self.folder / "log"
        self.launch("simulation.launch", f"port:={self.folder / 'board'}", *arguments, log=self.log)


class SimulatorNodeTest(NodeTest):
    """Tests with the same arguments share a simulation, one after the other: its start is most of a test's time."""

    _simulation: ClassVar = None

    @classmethod
    def stop_simulation(cls):
        if cls._simulation:
            cls._simulation.close()
            cls._simulation = None

    tearDownClass = stop_simulation

    def start(self, *arguments):
        """A simulation whose robot stands and has no fault."""
        if not self._simulation or self._simulation.arguments != arguments:
            self.stop_simulation()
            type(self)._simulation = Simulation(*arguments)
        self.log = self._simulation.log
        self.odom = self.listen("odom", Odometry)
        self.truth = self.listen("ground_truth/odom", Odometry)
        self.scan = self.listen("scan", LaserScan)
        wait_for(lambda: self.odom and self.truth, "odometry and ground truth", timeout=60)
        self.command = self.publisher("cmd_vel", Twist)
        self.rest()
        self.drive((0.0, 0.0, 0.0), lambda: self.says(OK, "no fault"), "a good start")
        self.wait_for_status(LINK, OK)

    def drive(self, speeds, until, what, timeout=20.0):
        wait_for(lambda: self.command.publish(twist(*speeds)) or until(), what, period=0.02, timeout=timeout)

    def rest(self):
        self.drive((0.0, 0.0, 0.0), lambda: max(map(abs, (
            self.truth[-1].twist.twist.linear.x, self.truth[-1].twist.twist.linear.y,
            self.truth[-1].twist.twist.angular.z))) < 0.01, "rest")

    def poses(self):
        """Newest poses by the odometry and in truth."""
        return pose(self.odom[-1]), pose(self.truth[-1])

    def moved(self, start):
        return math.dist(pose(self.truth[-1])[:2], start[:2])

    def error_since(self, start):
        """What the odometry's displacement (x [m], y [m], yaw [rad]) since `start` differs from the true one."""
        odom, truth = (between(before, after) for before, after in zip(start, self.poses()))
        x, y, turn = np.subtract(odom, truth)
        return x, y, wrap(turn)

    def test_drives_where_it_is_told_and_odometry_agrees_with_the_truth(self):
        self.start()
        start = self.poses()

        def gone():
            return between(start[1], pose(self.truth[-1]))
        self.drive((0.3, 0.0, 0.0), lambda: gone()[0] > 0.5, "forward")
        self.drive((0.0, 0.3, 0.0), lambda: gone()[1] > 0.5, "left")
        self.drive((0.0, 0.0, 1.0), lambda: wrap(gone()[2]) > 0.7, "counterclockwise")
        self.rest()
        np.testing.assert_allclose(self.error_since(start), 0.0, atol=0.05)
        self.assertEqual(self.truth[-1].header.frame_id, "map")
        self.wait_for_status(LINK, OK)
        self.assertEqual(self.values(LINK)["packets"], "checked")

    def test_unplugged_for_three_seconds_in_mid_drive(self):
        self.start()
        unplug = rospy.ServiceProxy("simulator_node/unplug", SetBool)
        start = pose(self.truth[-1])
        self.drive((0.3, 0.0, 0.0), lambda: self.moved(start) > 0.4, "motion")
        unplug(True)
        cut = self.truth[-1].header.stamp
        self.drive((0.3, 0.0, 0.0), lambda: abs(self.truth[-1].twist.twist.linear.x) < 0.05, "the stop")
        print(f"stopped {(self.truth[-1].header.stamp - cut).to_sec():.2f} s after the cable was pulled")
        self.assertLess((self.truth[-1].header.stamp - cut).to_sec(), 0.65)  # 0.6 s, and the newest truth was old
        self.wait_for_status(LINK, ERROR)
        self.drive((0.3, 0.0, 0.0), lambda: (self.truth[-1].header.stamp - cut).to_sec() > 3.0, "three seconds")
        unplug(False)
        stopped = pose(self.truth[-1])
        self.drive((0.3, 0.0, 0.0), lambda: self.moved(stopped) > 0.4, "motion after replugging")
        path = [pose(message)[:2] for message in self.odom]
        self.assertLess(np.linalg.norm(np.diff(path, axis=0), axis=1).max(), 0.3 * 0.02 * 1.6)
        self.wait_for_status(LINK, OK)
        self.assertNotIn("Traceback", self.log.read_text())

    def fault(self, topic, kind):
        """A latched publisher that ends with the test: it must not reach the next test's simulator."""
        publisher = rospy.Publisher("simulator_node/" + topic, kind, queue_size=1, latch=True)
        self.addCleanup(publisher.unregister)
        return publisher

    def test_faults_come_and_go(self):
        self.start()
        repaired = int(self.values(LINK)["periods repaired"])
        errors = self.fault("byte_errors", Float32)
        errors.publish(0.01)
        self.drive((0.2, 0.0, 0.3), lambda: int(self.values(LINK)["periods repaired"]) > repaired + 20, "repairs")
        errors.publish(0.0)
        grip = self.fault("wheel_grip", Float32MultiArray)
        grip.publish(Float32MultiArray(data=[0.02, 1.0, 1.0]))
        before = self.poses()
        self.drive((0.3, 0.0, 0.0), lambda: np.linalg.norm(self.error_since(before)[:2]) > 0.1, "an error from slip")
        grip.publish(Float32MultiArray(data=[1.0, 1.0, 1.0]))
        self.rest()
        push = self.fault("push", Vector3)
        start = pose(self.truth[-1])
        push.publish(Vector3(0.0, 3.0, 0.0))
        wait_for(lambda: pose(self.truth[-1])[1] - start[1] > 0.05, "the push")
        self.rest()

    def wheels_fault(self, topic, values, words, levels=(ERROR,)):
        """Drive with a fault until the diagnostics name it; then mend it, and stop until they are content."""
        fault = self.fault(topic, Int8MultiArray)
        good = [1, 1, 1] if topic != "jam" else [0, 0, 0]
        fault.publish(Int8MultiArray(data=values))
        try:
            self.drive((0.3, 0.0, 0.0), lambda: any(self.says(level, words) for level in levels), words)
        except AssertionError:
            status = self.status.get(BOARD)
            raise AssertionError(f"no {words!r} but {status and (status.level, status.message)}, wheels turn "
                                 f"{self.odom[-1].twist.twist.linear.x:.2f} m/s") from None
        fault.publish(Int8MultiArray(data=good))
        self.drive((0.0, 0.0, 0.0), lambda: self.says(OK, "no fault"), "the end of it")

    def says(self, level, words):
        status = self.status.get(BOARD)
        return status is not None and status.level == level and words in status.message

    def test_the_diagnostics_name_what_breaks(self):
        self.start()
        self.wheels_fault("encoders", [0, 1, 1], "wheel 0: no counts although it is driven: encoder unplugged")
        self.wheels_fault("encoders", [1, 1, -1], "wheel 2: counts against its direction: encoder or motor leads rev")
        self.wheels_fault("motors", [1, 1, 0], "wheel 2: ")
        # held while it stands: no counts; held while it turns, the others drag it: overloaded, its current limited
        self.wheels_fault("jam", [1, 0, 0], "wheel 0", levels=(WARN, ERROR))
        battery = self.fault("battery", Float32)
        battery.publish(9.0)
        self.drive((0.0, 0.0, 0.0), lambda: self.says(WARN, "the battery is low"), "the battery")
        battery.publish(12.0)
        self.drive((0.0, 0.0, 0.0), lambda: self.says(OK, "no fault"), "a good battery")

    def test_after_a_brown_out_the_robot_waits_for_zeros(self):
        self.start()
        self.drive((0.3, 0.0, 0.0), lambda: self.truth[-1].twist.twist.linear.x > 0.25, "motion")
        self.assertTrue(rospy.ServiceProxy("simulator_node/brown_out", Trigger)().success)
        self.drive((0.3, 0.0, 0.0), lambda: self.says(WARN, "waits for a command of zeros"), "the waiting")
        self.assertEqual(self.values(BOARD)["board reset"], "power")
        self.drive((0.3, 0.0, 0.0), lambda: abs(self.truth[-1].twist.twist.linear.x) < 0.02, "the stop")
        stopped = len(self.truth)
        self.drive((0.3, 0.0, 0.0), lambda: len(self.truth) > stopped + 25, "half a second")
        self.assertLess(max(abs(message.twist.twist.linear.x) for message in self.truth[stopped:]), 0.02)
        self.drive((0.0, 0.0, 0.0), lambda: self.says(OK, "no fault"), "the end of it")
        self.drive((0.3, 0.0, 0.0), lambda: self.truth[-1].twist.twist.linear.x > 0.25, "motion again")

    def test_with_a_room_the_laser_sees_its_walls(self):
        self.start("world:=room")
        wait_for(lambda: len(self.scan) > 3, "scans")
        scan = self.scan[-1]
        self.assertEqual(scan.header.frame_id, "laser")
        self.assertEqual(len(scan.ranges), 128)
        self.assertAlmostEqual(scan.ranges[64], 2.95, delta=0.02)
        self.assertAlmostEqual(scan.angle_max, 1.03 / 2, delta=1e-3)

    def simulator(self, port, *arguments):
        """A simulator_node without the driver; its process and log."""
        log = self.processes.folder / "simulator.log"
        return self.processes.start(places.program("robotont_simulator", "simulator_node"), f"_port:={port}",
                                    *arguments, log=log), log

    def test_ctrl_c_ends_it_at_once_and_leaves_nothing(self):
        rosparam.upload_params("/", yaml.safe_load(WHEEL_PARAMS.read_text()))
        port = self.processes.folder / "alone"
        process, log = self.simulator(port, "__name:=alone")
        wait_for(lambda: "a board at" in log.read_text(), "the board", timeout=30)
        self.wait_for_status("alone: real time", OK)
        begun = time.monotonic()
        self.processes.stop(process)
        self.assertLess(time.monotonic() - begun, 1.0)  # it waited that long for a thread that waited for it
        self.assertEqual([path.name for path in self.processes.folder.glob("alone*")], [])
        self.assertNotIn("Traceback", log.read_text())

    def test_names_that_no_port_can_have(self):
        rosparam.upload_params("/", yaml.safe_load(WHEEL_PARAMS.read_text()))
        folder = self.processes.folder
        for port, words in ((folder, "found something that is no link"), (folder / "missing" / "port", "no such file"),
                            ("''", "no such file")):
            process, log = self.simulator(port, "__name:=refused")
            wait_for(lambda process=process: process.poll() is not None, "the end", timeout=30)
            self.assertEqual(process.returncode, 1)
            self.assertIn(words, log.read_text())
            self.assertNotIn("Traceback", log.read_text())

    def test_a_world_that_is_not_there(self):
        self.stop_simulation()  # its nodes have the same names
        log = self.processes.folder / "log"
        port = self.processes.folder / "board"
        launch = self.processes.launch("simulation.launch", "world:=moon", f"port:={port}", log=log)
        wait_for(lambda: "moon.yaml" in log.read_text(), "words about the world")
        self.assertIsNone(launch.poll())
        self.assertNotIn("Traceback", log.read_text())


if __name__ == "__main__":
    rostest.rosrun("robotont_simulator", "simulator_node_test", SimulatorNodeTest)

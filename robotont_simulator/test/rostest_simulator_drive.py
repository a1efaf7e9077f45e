#!/usr/bin/env python3
"""Drives on one simulator: odometry against the truth, a pulled cable, every fault and what diagnostics say of it."""

import itertools
import sys

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import Vector3
from simulation_test import BOARD, LINK, SimulationTest, pose
from std_msgs.msg import Float32, Float32MultiArray, Int8MultiArray
from std_srvs.srv import Trigger

from robotont_driver.kinematics.se2 import between, wrap
from robotont_testing.harness import wait_for
from robotont_testing.node_test import ERROR, OK, WARN, twist


class SimulatorDriveTest(SimulationTest):
    def test_drives_as_commanded_and_odometry_agrees_with_the_truth(self):
        self.start("description:=false")
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

    def test_after_a_brown_out_the_robot_waits_for_zeros(self):
        self.start("description:=false")
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


class NightlySimulatorDriveTest(SimulationTest):
    """Once a day."""

    def fault(self, topic, kind):
        """A latched publisher that ends with the test: it must not reach the next test's simulator."""
        publisher = rospy.Publisher("simulator_node/" + topic, kind, queue_size=1, latch=True)
        self.addCleanup(publisher.unregister)
        return publisher

    def wheels_fault(self, topic, values, words, levels=(ERROR,)):
        """Drive with a fault until the diagnostics name it; then mend it, and stop until they are content."""
        fault = self.fault(topic, Int8MultiArray)
        good = [1, 1, 1] if topic != "jam" else [0, 0, 0]
        fault.publish(Int8MultiArray(data=values))
        self.drive((0.3, 0.0, 0.0), lambda: any(self.says(level, words) for level in levels), words)
        fault.publish(Int8MultiArray(data=good))
        self.drive((0.0, 0.0, 0.0), lambda: self.says(OK, "no fault"), "the end of it")

    def test_faults_come_and_go(self):
        self.start("description:=false")
        repaired = int(self.values(LINK)["periods repaired"])
        errors = self.fault("byte_errors", Float32)
        errors.publish(0.01)
        self.drive((0.2, 0.0, 0.3), lambda: int(self.values(LINK)["periods repaired"]) > repaired + 20, "repairs")
        errors.publish(0.0)
        grip = self.fault("wheel_grip", Float32MultiArray)
        grip.publish(Float32MultiArray(data=[0.02, 1.0, 1.0]))
        before = self.poses()
        speeds = itertools.cycle([0.3] * 100 + [0.0] * 50)  # a wheel that only rolls on needs no grip: it must start

        def slipped():
            self.command.publish(twist(next(speeds)))
            return np.linalg.norm(self.error_since(before)[:2]) > 0.1
        wait_for(slipped, "an error from slip", period=0.02)
        grip.publish(Float32MultiArray(data=[1.0, 1.0, 1.0]))
        self.rest()
        push = self.fault("push", Vector3)
        start = pose(self.truth[-1])
        push.publish(Vector3(0.0, 3.0, 0.0))
        wait_for(lambda: pose(self.truth[-1])[1] - start[1] > 0.05, "the push")
        self.rest()

    def test_the_diagnostics_name_what_breaks(self):
        self.start("description:=false")
        self.wheels_fault("encoders", [0, 1, 1], "wheel 0: no counts although it is driven: "
                          "encoder unplugged")
        self.wheels_fault("motors", [1, 1, 0], "wheel 2: ")
        # held while it stands: no counts; held while it turns, the others drag it: overloaded, its current limited
        self.wheels_fault("jam", [1, 0, 0], "wheel 0", levels=(WARN, ERROR))
        battery = self.fault("battery", Float32)
        battery.publish(9.0)
        self.drive((0.0, 0.0, 0.0), lambda: self.says(WARN, "the battery is low"), "the battery")
        battery.publish(12.0)
        self.drive((0.0, 0.0, 0.0), lambda: self.says(OK, "no fault"), "a good battery")


if __name__ == "__main__":
    rostest.rosrun("robotont_simulator", "simulator_drive_test",
                    NightlySimulatorDriveTest if "nightly" in sys.argv else SimulatorDriveTest)

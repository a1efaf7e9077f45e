#!/usr/bin/env python3
"""What has its time: drives on the simulator, a pulled cable, its end."""

import time

import numpy as np
import rosparam
import rospy
import rostest
import yaml
from simulation_test import LINK, SimulationTest, pose
from std_srvs.srv import SetBool

from robotont_driver.kinematics.se2 import between, wrap
from robotont_testing.harness import wait_for
from robotont_testing.node_test import ERROR, OK
from robotont_testing.robots import WHEEL_PARAMS


class SimulatorDriveTest(SimulationTest):
    def test_drives_as_commanded_and_odometry_agrees_with_the_truth(self):
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


if __name__ == "__main__":
    rostest.rosrun("robotont_simulator", "simulator_drive_test", SimulatorDriveTest)

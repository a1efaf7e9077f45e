#!/usr/bin/env python3
"""RViz on a virtual screen, a robot on a stand-in board, and checks of the picture."""

import math
import tempfile
import xmlrpc.client
from pathlib import Path

import numpy as np
import rospy
import rostest
from geometry_msgs import msg as geometry
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.msg import Path as PathMessage
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from robotont_testing import rviz_sight as sight
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest
from robotont_testing.robots import SHIPPED
from robotont_testing.rviz_stage import Robot, Stage, drawn_seldom, save_picture, seen_from_above

PIXELS = 0.010    # [m] 3 pixels
# Debian's RViz looks for a package that it can do without; Mesa's software GL links the maps' shader with a remark.
# A display of RViz that subscribes anew as it opens ends a connection that has not said yet what it is for.
HARMLESS = ("media_export", "librospack", "glsl120/indexed_8bit_image", "terminated before handshake header")


class RvizTest(NodeTest):
    """Each test starts RViz as a person does, with a launch file."""

    def setUp(self):
        super().setUp()
        self.stage = Stage()
        self.addCleanup(self.stage.close)
        self.log = self.stage.folder / "rviz.log"
        self.warnings = []
        self.listen("/rosout", Log, self._on_log)

    def _on_log(self, message):
        if message.level >= Log.WARN and not _is_harmless(message.msg):
            self.warnings.append(f"{message.name}: {message.msg}")

    def start_robot(self, *arguments):
        robot = Robot(self.stage, *arguments)
        self.addCleanup(robot.close)
        return robot

    def wait_to_see(self, condition, what, timeout=30.0):
        """The value of `condition(picture)` once it is true; the last picture is kept when it never is."""
        why = ""

        def look():
            nonlocal why
            try:
                return condition(self.stage.picture())
            except (sight.UnseenError, ValueError) as error:  # ValueError: the screen is being painted
                why = str(error)
            return False
        try:
            return wait_for(look, what, timeout, 0.1)
        except AssertionError as error:
            file = Path(tempfile.gettempdir()) / f"robotont_{self.id()}.png"
            save_picture(self.stage.picture(), file)
            raise AssertionError(f"{error} {why}; see {file}\n{self.log.read_text()}") from None

    def see_content(self, displays):
        self.wait_to_see(lambda picture: sight.content_displays(picture) == displays
                         and not sight.complaints(picture), f"{displays} displays without a complaint")

    def see_at(self, x, y):
        """Wait until the robot is within PIXELS of (x, y) [m], seen from the lower left crossing."""
        def at(picture):
            seen = sight.position(picture)
            if math.hypot(seen[0] - x, seen[1] - y) > PIXELS:
                raise sight.UnseenError(f"the robot is at {seen}")
            return seen
        return self.wait_to_see(at, f"the robot at {(x, y)}")

    def check_logs(self):
        self.assertEqual(self.warnings, [])
        self.assertEqual([line for line in self.log.read_text().splitlines() if not _is_harmless(line)
                          and any(word in line.lower() for word in ("warn", "error", "tf_"))], [])

    def test_the_drive_of_figures_11_and_12(self):
        robot = self.start_robot()
        config, view = seen_from_above("odometry.rviz", self.stage.folder)
        self.stage.show("rviz.launch", f"view:={config}", log=self.log)
        self.see_content(5)
        before = self.see_at(0.0, 0.0)
        picture = self.stage.picture()
        self.assertAlmostEqual(sight.scale(picture), view["Scale"], delta=1.0)
        self.assertAlmostEqual(sight.heading(picture), 0.0, delta=0.05)
        start = sight.robot_centre(picture)

        robot.drive_to((2.0, 1.0, math.pi / 2))
        self.see_at(before[0] + 2.0, before[1] + 1.0)
        self.wait_to_see(lambda picture: abs(sight.heading(picture) - math.pi / 2) < 0.05, "the turn")
        # 2 m to the right and 1 m up, as x and y of a map are drawn
        end = sight.robot_centre(self.stage.picture())
        np.testing.assert_allclose(np.subtract(end, start) / view["Scale"], (2.0, -1.0), atol=PIXELS)
        middle = np.rint(np.add(start, end) / 2).astype(int)
        self.wait_to_see(lambda picture: sight.is_way(picture, *middle), "the way")

        rospy.ServiceProxy("reset_odometry", Trigger)()
        self.see_at(*before)
        self.see_content(5)
        self.check_logs()

    def test_the_model_alone_and_the_end_of_all_when_rviz_is_closed(self):
        launch = self.stage.show("display.launch", log=self.log)
        self.see_content(2)
        self.wait_to_see(lambda picture: (picture[sight.VIEW].max(axis=2) < 100).sum() > 20000, "a robot")
        self.check_logs()
        xmlrpc.client.ServerProxy(self.stage.node_uri("/rviz")).shutdown("/test", "closed")
        wait_for(lambda: launch.poll() is not None, "the end of all")

    def test_navigation_and_displays_that_complain_before_there_is_a_map(self):
        self.start_robot()
        stand_in = NavigationStandIn(self)
        config = drawn_seldom("navigation.rviz", self.stage.folder)
        self.stage.show("rviz.launch", f"view:={config}", log=self.log)
        wait_for(stand_in.is_heard, "RViz to subscribe")
        self.wait_to_see(lambda picture: sight.complaints(picture) > 100, "complaints about a frame that is not")
        timer = rospy.Timer(rospy.Duration(0.2), lambda _event: stand_in.publish())
        self.addCleanup(timer.shutdown)
        self.see_content(14)
        self.check_logs()

    def test_two_robots(self):
        for name, parameters in (("robot1", None), ("robot2", SHIPPED)):
            self.start_robot(name, parameters)
        config, _ = seen_from_above("two_robots.rviz", self.stage.folder)
        self.stage.show("rviz_two_robots.launch", f"view:={config}", log=self.log)
        self.see_content(8)
        self.check_logs()


def _is_harmless(words):
    return any(known in words for known in HARMLESS)


class NavigationStandIn:
    """Publishes what amcl, move_base and a scanner would, none of which Debian has."""

    def __init__(self, test):
        ahead = geometry.Quaternion(w=1.0)
        here = geometry.Pose(orientation=ahead)
        cells = OccupancyGrid(info=MapMetaData(resolution=0.5, width=8, height=8, origin=here), data=[50] * 64)
        way = PathMessage(poses=[geometry.PoseStamped(Header(frame_id="map"), here)])
        scan = LaserScan(angle_increment=0.1, range_max=10.0, ranges=[2.0] * 20)  # RViz ends at one without ranges
        scan.header.frame_id = "laser"
        messages = {
            "map": cells, "move_base/global_costmap/costmap": cells, "move_base/local_costmap/costmap": cells,
            "move_base/local_costmap/footprint": geometry.PolygonStamped(), "scan": scan,
            "move_base/current_goal": geometry.PoseStamped(pose=here),
            "particlecloud": geometry.PoseArray(poses=[here]),
            "amcl_pose": geometry.PoseWithCovarianceStamped(pose=geometry.PoseWithCovariance(pose=here)),
            "move_base/NavfnROS/plan": way, "move_base/DWAPlannerROS/local_plan": way}
        self._transform = geometry.TransformStamped(Header(frame_id="map"), "odom",
                                                    geometry.Transform(rotation=ahead))
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=10)
        test.addCleanup(self._tf.unregister)
        self._topics = []
        for topic, message in messages.items():
            self._topics.append((rospy.Publisher("/" + topic, type(message), queue_size=1), message))
            test.addCleanup(self._topics[-1][0].unregister)

    def is_heard(self):
        return all(publisher.get_num_connections() for publisher, _ in self._topics)

    def publish(self):
        now = rospy.Time.now()
        self._transform.header.stamp = now + rospy.Duration(0.3)
        self._tf.publish([self._transform])
        for publisher, message in self._topics:
            message.header.frame_id, message.header.stamp = message.header.frame_id or "map", now
            publisher.publish(message)


if __name__ == "__main__":
    rostest.rosrun("robotont_bringup", "rviz", RvizTest)

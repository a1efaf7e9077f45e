#!/usr/bin/env python3
"""Draws the pictures of the model and of RViz: draw_rviz_pictures.py [FOLDER]. Needs no robot, monitor or ROS master.

odometry_at_0_0.png and odometry_at_2_1.png: the thesis' Figures 11 and 12. odometry.png: the window as
rviz.launch opens it, after the same drive. two_robots.png: that of rviz_two_robots.launch. robot.png and
robot_with_5_wheels.png: the model alone. navigation.png: move_base at work in the simulated room, only where the
navigation stack is installed.
"""

import math
import sys
from pathlib import Path

import rospkg
import rospy
from nav_msgs.msg import Odometry
from std_srvs.srv import Trigger

from robotont_testing import places
from robotont_testing import rviz_sight as sight
from robotont_testing.harness import Master, wait_for
from robotont_testing.robots import ROBOTS, robot_folder
from robotont_testing.rviz_stage import Robot, Stage, save_picture, seen_from_above

GOAL_IN_THE_ROOM = (8, 8, 1.57)  # x [m], y [m], yaw [rad]
GOAL = (2.0, 1.0, math.pi / 2)  # x [m], y [m], yaw [rad]


def main():
    """Make all pictures, in docs/pictures or in the folder that the command line names."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    with Master():
        rospy.init_node("pictures", disable_signals=True)
        draw_model(folder / "robot.png")
        draw_model(folder / "robot_with_5_wheels.png", ROBOTS["uneven5"])
        draw_drive(folder)
        draw_two_robots(folder / "two_robots.png")
        draw_navigation(folder / "navigation.png")


def draw_model(file, parameters=None):
    """The robot in display.launch's window, for some wheel parameters or the shipped ones."""
    with Stage() as stage:
        arguments = []
        if parameters:
            arguments = ["robot:=" + robot_folder(stage.folder / "pictured", parameters)]
        stage.show("display.launch", *arguments)
        keep(still(stage, displays=2)[150:690, 434:1194], file)  # the window's 3D part without its edges


def draw_drive(folder):
    """A drive to GOAL, seen from above at its start and end, and in the window as it opens."""
    with Stage() as stage:
        robot = Robot(stage)
        config, _ = seen_from_above("odometry.rviz", stage.folder)
        from_above = stage.show("rviz.launch", f"view:={config}")
        keep(still(stage, displays=5), folder / "odometry_at_0_0.png")
        robot.drive_to(GOAL)
        keep(still(stage, displays=5), folder / "odometry_at_2_1.png")
        stage.stop(from_above)
        rospy.ServiceProxy("reset_odometry", Trigger)()
        stage.show("rviz.launch")
        still(stage, displays=5)
        robot.drive_to(GOAL)
        keep(still(stage, displays=5), folder / "odometry.png")
        robot.close()


def draw_two_robots(file):
    """Two robots in namespaces, each after a drive of its own, in the window as it opens."""
    with Stage() as stage:
        robots = [Robot(stage, "robot1"), Robot(stage, "robot2")]
        stage.show("rviz_two_robots.launch")
        still(stage, displays=8)
        robots[0].drive_to((1.5, 0.3, 1.0))
        robots[1].drive_to((1.0, -0.3, -1.0))
        keep(still(stage, displays=8), file)
        for robot in robots:
            robot.close()


def draw_navigation(file):
    """The window of navigation while the robot is on its way to GOAL_IN_THE_ROOM; omitted without move_base."""
    if not all(package in rospkg.RosPack().list() for package in ("move_base", "amcl", "map_server")):
        print(f"{file} stays as it is: the navigation stack is missing (ros-noetic-navigation)")
        return
    with Stage() as stage:
        truth = []
        subscriber = rospy.Subscriber("ground_truth/odom", Odometry, truth.append, queue_size=1)
        stage.show("navigation.launch", "sim:=true", "rviz:=true", f"port:={stage.folder / 'board'}")
        wait_for(lambda: sight.content_displays(stage.picture()) == 13, "all that RViz shows", 90.0, 0.5)
        stage.start(places.program("robotont_map_navigation", "goto"), *GOAL_IN_THE_ROOM)
        wait_for(lambda: truth[-1].pose.pose.position.y > 3.7 and not sight.complaints(stage.picture()),
                 "the robot on its way", 60.0, 0.2)
        keep(stage.picture(), file)
        subscriber.unregister()


def still(stage, displays):
    """A picture with so many content displays, in which nothing has changed for a second."""
    seen = []

    def unchanged():
        picture = stage.picture()
        if sight.content_displays(picture) != displays or sight.complaints(picture) \
                or (seen and (seen[-1][sight.VIEW] != picture[sight.VIEW]).any()):
            seen.clear()
        seen.append(picture)
        return len(seen) > 10
    wait_for(unchanged, "a picture that stands still", 60.0, 0.1)
    return seen[-1]


def keep(picture, file):
    """Save it and print its path."""
    save_picture(picture, file)
    print(f"{file} ({file.stat().st_size / 1000:.0f} kB)")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""navigation_monitor: the tolerance within which DWAPlannerROS stays at its goal."""

import rospy
import rostest
from dynamic_reconfigure.srv import Reconfigure, ReconfigureResponse
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseActionFeedback, MoveBaseActionResult

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.node_test import NodeTest

MONITOR = places.program("robotont_map_navigation", "navigation_monitor")


class ArrivalTest(NodeTest):
    """The place of move_base is taken by this test."""

    def test_the_goal_s_tolerance_is_wide_from_the_arrival_to_the_goal_s_end(self):
        heard = []

        def reconfigure(request):
            heard.extend((each.name, each.value) for each in request.config.doubles)
            return ReconfigureResponse()
        service = rospy.Service("move_base/DWAPlannerROS/set_parameters", Reconfigure, reconfigure)
        self.addCleanup(service.shutdown)
        self.processes.start(MONITOR)
        goal = self.publisher("move_base/current_goal", PoseStamped)
        feedback = self.publisher("move_base/feedback", MoveBaseActionFeedback)
        result = self.publisher("move_base/result", MoveBaseActionResult)
        narrow, wide = ("xy_goal_tolerance", 0.02), ("xy_goal_tolerance", 0.06)
        message, place = PoseStamped(), MoveBaseActionFeedback()
        message.pose.position.x = 2.0
        for end, so_far in ((result, MoveBaseActionResult()), (goal, message)):
            heard.clear()
            goal.publish(message)
            for x in (1.0, 1.96, 1.98, 1.96):
                place.feedback.base_position.pose.position.x = x
                feedback.publish(place)
                rospy.sleep(0.1)
            wait_for(lambda: heard[-1:] == [wide], "the arrival")
            end.publish(so_far)
            wait_for(lambda: heard[-1] == narrow, "the goal's end, or the next one")
            self.assertEqual([each for each in heard if each == wide], [wide])


if __name__ == "__main__":
    rostest.rosrun("robotont_map_navigation", "arrival", ArrivalTest)

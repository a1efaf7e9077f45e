"""A release that waits for a master that hangs is dropped, and so are those behind it."""

import time

import rospy
from std_msgs.msg import String
from std_srvs.srv import Trigger

from robotont_teleop.emergency_stop_client import EmergencyStopClient
from robotont_teleop.robot_requests import OLDEST_REQUEST, ServiceRequest
from robotont_testing.harness import Master, in_own_process, suspended, wait_for
from robotont_testing.robots import WHEEL_PARAMS


@in_own_process
def test_a_release_is_never_carried_out_late():
    with Master() as master:
        rospy.init_node("hand", disable_signals=True)
        master.start("rosparam", "load", WHEEL_PARAMS).wait()
        master.node("driver_node")
        said, failures = [], []
        rospy.Subscriber("emergency_stop/pressed_by", String, lambda message: said.append(message.data))
        button = EmergencyStopClient(failures.append)
        wait_for(lambda: said, "driver_node")
        button.press()
        wait_for(lambda: said[-1] == "/hand", "the press")
        with suspended(master._master.pid):
            button.release()
            time.sleep(0.1)  # the first is on its way to the master
            button.release()
            button.press()  # newer than both
            time.sleep(OLDEST_REQUEST)  # so long they take
        wait_for(lambda: len(failures) == 2, "words about both")
        assert said[-1] == "/hand"
        assert button.pressed
        button.release()
        wait_for(lambda: said[-1] == "" and not button.pressed, "a release that is asked for now")


@in_own_process
def test_other_requests_of_a_person_are_not_carried_out_late_either():
    with Master() as master:
        rospy.init_node("hand", disable_signals=True)
        asked, said = [], []
        rospy.Service("reset_odometry", Trigger, lambda request: asked.append(request) or (True, ""))
        request = ServiceRequest("reset_odometry", "reset odometry", Trigger, lambda *words: said.append(words))
        with suspended(master._master.pid):
            request.call()
            time.sleep(OLDEST_REQUEST)  # so long it takes
        wait_for(lambda: said, "words")
        assert not said[0][1], said
        assert not asked
        request.call()
        wait_for(lambda: len(said) == 2, "words")
        assert said[1][1], said
        assert len(asked) == 1

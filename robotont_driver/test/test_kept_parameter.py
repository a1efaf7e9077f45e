"""What driver_node keeps on the master: told again to a new one."""

import pytest
import rospy
from std_msgs.msg import Bool

from robotont_testing.harness import Master, wait_for
from robotont_testing.robots import WHEEL_PARAMS


@pytest.fixture
def master():
    with Master() as processes:
        yield processes


def test_a_press_outlives_the_master(master):
    rospy.init_node("button", disable_signals=True)
    master.start("rosparam", "load", WHEEL_PARAMS).wait()
    master.node("driver_node")
    button = rospy.Publisher("emergency_stop", Bool, queue_size=1)
    wait_for(button.get_num_connections, "driver_node")
    button.publish(True)
    wait_for(lambda: rospy.get_param("emergency_stop_pressed", []) == ["/button"], "the parameter")
    master.stop_master()
    master.start_master()
    wait_for(lambda: rospy.get_param("emergency_stop_pressed", []) == ["/button"], "the parameter on the new master")

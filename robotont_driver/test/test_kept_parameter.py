"""A master that ends: what driver_node keeps on it is told again to a new one, and no node dies of it."""

import threading

import rospy
from std_msgs.msg import Bool

from robotont_driver.ros.diagnostics import OK, Health
from robotont_testing.harness import Master, in_own_process, wait_for
from robotont_testing.robots import WHEEL_PARAMS


@in_own_process
def test_a_press_outlives_the_master():
    with Master() as master:
        rospy.init_node("button", disable_signals=True)
        master.load(WHEEL_PARAMS)
        master.node("driver_node")
        button = rospy.Publisher("emergency_stop", Bool, queue_size=1)
        wait_for(button.get_num_connections, "driver_node")
        button.publish(True)
        wait_for(lambda: rospy.get_param("emergency_stop_pressed", []) == ["/button"], "the parameter")
        master.stop_master()
        master.start_master()
        wait_for(lambda: rospy.get_param("emergency_stop_pressed", []) == ["/button"], "the new master's parameter")


@in_own_process
def test_a_node_that_starts_lives_on_without_the_master():
    with Master() as master:
        rospy.init_node("node", disable_signals=True)
        master.stop_master()
        made = []
        starts = threading.Thread(target=lambda: made.append(Health("robot", {"subject": lambda: (OK, "", {})})))
        starts.start()
        master.start_master()
        wait_for(lambda: not starts.is_alive(), "the node")
        assert made

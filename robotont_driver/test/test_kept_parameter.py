"""A master that ends: what driver_node keeps on it is told again to a new one, and no node dies of it."""

import signal
import threading

import rospy
from geometry_msgs.msg import Twist, Vector3
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

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
def test_who_has_to_stop_first_has_to_behind_a_restart():
    with Master() as master:
        rospy.init_node("program", disable_signals=True)
        master.load(WHEEL_PARAMS)
        driver, moves = master.node("driver_node"), []
        rospy.Subscriber("serial_write", String, lambda packet: moves.append(bool(packet.data.strip("0.:;\n"))))
        button, wheel = (rospy.Publisher(name, kind, queue_size=1) for name, kind in (
            ("emergency_stop", Bool), ("cmd_vel", Twist)))
        wait_for(lambda: button.get_num_connections() and wheel.get_num_connections(), "driver_node")
        rospy.Timer(rospy.Duration(0.05), lambda _: wheel.publish(Twist(linear=Vector3(x=0.2))))
        wait_for(lambda: moves and moves[-1], "motion")
        button.publish(True)
        wait_for(lambda: not moves[-1], "the stop")
        rospy.ServiceProxy("emergency_stop/release", Trigger)()
        wait_for(lambda: rospy.get_param("emergency_stop_held", []) == ["/program"], "the parameter")
        master.stop(driver, signal.SIGKILL)
        del moves[:]
        master.node("driver_node")
        wait_for(lambda: len(moves) > 20, "the new node's packets")
        assert not any(moves)


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

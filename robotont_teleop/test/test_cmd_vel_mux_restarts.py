"""cmd_vel_mux with driver_node behind it: what is on the wire at its end, and what outlives a restart."""

import itertools
import signal
import time

import pytest
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, String

from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_testing import places
from robotont_testing.harness import Master, in_own_process, wait_for
from robotont_testing.node_test import twist
from robotont_testing.robots import WHEEL_PARAMS

pytestmark = pytest.mark.timed
STOPPED = "0.00:0.00:0.00;\n"


@in_own_process
def test_its_end_is_a_zero_and_an_emergency_stop_outlives_it():
    """A hand commands all the time; one looks at the wire."""
    with Master() as master:
        rospy.init_node("hand", disable_signals=True)
        master.load(WHEEL_PARAMS)
        master.node("driver_node")
        packets, commands, drivers = [], [], []  # whether it moves, [m/s], names
        for topic, kind, callback in (
                ("serial_write", String, lambda message: packets.append(message.data != STOPPED)),
                ("cmd_vel", Twist, lambda message: commands.append(message.linear.x)),
                ("cmd_vel/driven_by", String, lambda message: drivers.append(message.data))):
            rospy.Subscriber(topic, kind, callback, tcp_nodelay=True)
        command = rospy.Publisher("cmd_vel/hand", Twist, queue_size=1, tcp_nodelay=True)
        button = rospy.Publisher("emergency_stop", Bool, queue_size=1, tcp_nodelay=True)
        speeds = [itertools.repeat(0.1)]
        RepeatingThread(lambda: command.publish(twist(next(speeds[-1]))) or 0.02)

        def moves_nothing(seconds):
            seen = len(commands)
            time.sleep(seconds)
            assert not any(commands[seen:])
            assert not packets[-1]
        program = places.program("robotont_teleop", "cmd_vel_mux")
        mux = master.start(program)
        wait_for(lambda: packets and packets[-1] and drivers and any(commands), "motion, heard of from all three")
        master.stop(mux, signal.SIGTERM)  # amid commands
        wait_for(lambda: commands[-1] == 0.0, "the zero")
        button.publish(True)
        mux = master.start(program)
        wait_for(lambda: drivers[-1] == "emergency stop", "the next mux")
        moves_nothing(0.3)
        button.publish(False)
        wait_for(lambda: rospy.get_param("cmd_vel_mux_held", []) == ["/hand"], "who has to stop first")
        master.stop(mux, signal.SIGKILL)
        drivers.clear()
        master.start(program)
        wait_for(lambda: drivers, "the mux after that")
        moves_nothing(1.0)  # the hand has not let go yet
        speeds.append(itertools.cycle(5 * (0.0,) + 5 * (0.1,)))  # lets go, and drives
        wait_for(lambda: packets[-1], "motion again")

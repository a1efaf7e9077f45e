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


class Hand:
    """Somebody at a stick, who looks at the wire."""

    def __init__(self):
        self.packets, self.commands, self.driver = [], [], ""  # (time [s], packet); [m/s]
        self.publisher = rospy.Publisher("cmd_vel/hand", Twist, queue_size=1, tcp_nodelay=True)
        self.button = rospy.Publisher("emergency_stop", Bool, queue_size=1, tcp_nodelay=True)
        for topic, kind, callback in (
                ("serial_write", String, lambda message: self.packets.append((time.monotonic(), message.data))),
                ("cmd_vel", Twist, lambda message: self.commands.append(message.linear.x)),
                ("cmd_vel/driven_by", String, lambda message: setattr(self, "driver", message.data))):
            rospy.Subscriber(topic, kind, callback, tcp_nodelay=True)
        self.speeds = itertools.repeat(0.1)
        RepeatingThread(self._command)

    def _command(self):
        self.publisher.publish(twist(next(self.speeds)))
        return 0.02

    def moves(self):
        wait_for(lambda: self.packets and self.packets[-1][1] != STOPPED, "motion")

    def stop(self):
        """Press; [s] until the zero is on the wire."""
        pressed = time.monotonic()
        self.button.publish(True)
        return wait_for(lambda: next(
            (at for at, packet in self.packets if at > pressed and packet == STOPPED), None), "the stop") - pressed

    def moves_nothing(self, seconds):
        seen = len(self.commands)
        time.sleep(seconds)
        assert not any(self.commands[seen:])
        assert self.packets[-1][1] == STOPPED


@in_own_process
def test_its_end_is_a_zero_and_an_emergency_stop_outlives_it():
    with Master() as master:
        rospy.init_node("hand", disable_signals=True)
        master.load(WHEEL_PARAMS)
        master.node("driver_node")
        hand, program = Hand(), places.program("robotont_teleop", "cmd_vel_mux")
        mux = master.start(program)
        hand.moves()
        master.stop(mux, signal.SIGTERM)  # amid commands
        wait_for(lambda: hand.commands[-1] == 0.0, "the zero")
        hand.button.publish(True)
        mux = master.start(program)
        wait_for(lambda: hand.driver == "emergency stop", "the next mux")
        hand.moves_nothing(0.3)
        hand.button.publish(False)
        wait_for(lambda: rospy.get_param("cmd_vel_mux_held", []) == ["/hand"], "who has to stop first")
        master.stop(mux, signal.SIGKILL)
        hand.driver = ""
        master.start(program)
        wait_for(lambda: hand.driver, "the mux after that")
        hand.moves_nothing(1.0)  # it has not let go yet
        hand.speeds = itertools.chain.from_iterable(itertools.repeat(5 * (0.0,) + 5 * (0.1,)))  # lets go, and drives
        hand.moves()
        assert hand.stop() < 0.05

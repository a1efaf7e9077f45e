"""keyboard_teleop in terminals of its own: what terminals do, and every way to end it."""

import contextlib
import os
import signal
import time

import pytest
import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String
from terminal import Terminal

from robotont_testing import places
from robotont_testing.harness import Master, in_own_process, suspended, wait_for
from robotont_testing.robots import WHEEL_PARAMS

pytestmark = pytest.mark.timed
HOLD = 2.0  # [s] that one press lasts: what stops sooner has another reason
ENDS = (("Ctrl-C", lambda terminal: terminal.type("\x03")),
        ("Esc", lambda terminal: terminal.type("\x1b")),
        ("a lost terminal", lambda terminal: terminal.hang_up()),
        ("SIGTERM", lambda terminal: os.killpg(terminal.process.pid, signal.SIGTERM)),
        ("SIGKILL, by the mux", lambda terminal: terminal.end()))


@in_own_process
def test_space_stops_whatever_terminals_do_and_each_end_stops_the_robot():
    with Master() as master, contextlib.ExitStack() as ends:
        rospy.init_node("hand", disable_signals=True)
        master.load(WHEEL_PARAMS)
        master.node("driver_node")
        master.start(places.program("robotont_teleop", "cmd_vel_mux"))
        heard = {topic: [] for topic in ("cmd_vel", "cmd_vel/hand", "emergency_stop/pressed_by")}
        for topic, messages in heard.items():
            subscriber = rospy.Subscriber(topic, String if "stop" in topic else Twist, messages.append)
        wait_for(subscriber.get_num_connections, "driver_node", 60.0)
        terminals = [Terminal(f"_first_hold:={HOLD}") for _ in ENDS]  # they start side by side
        for terminal in terminals:
            ends.callback(terminal.end)
            terminal.type("w")
        for terminal in terminals:
            wait_for(lambda terminal=terminal: "| mux: " in terminal.line, "its line", 60.0)
        time.sleep(0.5)  # nothing happens
        assert not any(one.linear.x for one in heard["cmd_vel/hand"]), "a key that was typed while it started"
        try_space(terminals[0], heard["emergency_stop/pressed_by"])
        for terminal, (what, act) in zip(terminals, ENDS):
            try_end(terminal, heard["cmd_vel"], heard["cmd_vel/hand"], what, act)


def try_space(terminal, stops):
    """While the terminal takes no output, and behind Ctrl-Z and fg without Enter."""
    def still():
        shown = len(terminal.shown)
        time.sleep(0.3)
        return len(terminal.shown) == shown

    def stop():
        """Released by its key, as a person does: again where a busy computer has held it up."""
        terminal.type(" ")
        wait_for(lambda: stops and stops[-1].data, "the stop")
        wait_for(lambda: not stops[-1].data or terminal.type("\x15"), "the release", period=0.3)
    terminal.type("\x13")  # Ctrl-S
    wait_for(still, "the end of its output")
    stop()
    terminal.type("\x11")  # Ctrl-Q
    wait_for(lambda: not still(), "its output")
    with suspended(terminal.process.pid):
        terminal.take_whole_lines()
    stop()


def try_end(terminal, commands, hand, what, act):
    hand.clear()
    wait_for(lambda: (hand and hand[-1].linear.x) or terminal.type("w"), "motion", period=0.2)
    pressed = time.monotonic()
    wait_for(lambda: commands and commands[-1].linear.x > 0, "motion of the robot")
    act(terminal)
    wait_for(lambda: commands[-1].linear.x == 0.0, f"the stop after {what}")
    assert time.monotonic() - pressed < HOLD, what
    if "SIGKILL" not in what:
        wait_for(lambda: hand[-1].linear.x == 0.0, f"its own zero after {what}")
        terminal.process.wait(20)
        assert "Traceback" not in terminal.shown

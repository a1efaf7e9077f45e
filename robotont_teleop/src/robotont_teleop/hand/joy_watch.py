"""Watches a gamepad of the packages joy and teleop_twist_joy: its STOP button, and whether it is still there.

Between joy_node, which repeats the newest state for ever, and teleop_twist_joy, which believes it.
"""

import math

import rospy
from sensor_msgs.msg import Joy

from robotont_driver.command.command_age import SILENCE, Gaps
from robotont_driver.link.boot_clock import boot_time
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.diagnostics import OK, WARN, Health, robot_name
from robotont_driver.ros.lifecycle import run_without_wheels
from robotont_driver.rospy_repairs.rospy_internals import connection_header
from robotont_teleop.hand.emergency_stop_publisher import EmergencyStopPublisher

MOST_BUTTONS = 100
MOST_WAITING = 100  # messages
PARAMETERS = (
    Parameter("longest_still", 1.5, "without a change of any stick or button, after which the robot stops: the pad "
              "may be out of reach", "s", minimum=0.3, maximum=5.0,
              reason="for so long the robot drives on when the pad is gone"),
    Parameter("dead_man_button", 4, "as enable_button of teleop_twist_joy; 4: left shoulder", minimum=0,
              maximum=MOST_BUTTONS),
    Parameter("stop_button", 1, "emergency stop; 1: the right-hand one of the four", minimum=0, maximum=MOST_BUTTONS),
    Parameter("release_button", 7, "releases it together with the dead-man button; 7: Start of an Xbox pad", minimum=0,
              maximum=MOST_BUTTONS),
)
SILENT = 2.0  # [s] without a message of joy_node, after which there is no pad


class StillPad:
    """Whether a gamepad is still there. longest: [s] without a change of any stick or button, after which it is not.

    A pad with a radio that is out of reach looks like one whose sticks are held still: the receiver stays plugged in,
    and repeats nothing. So only what changes is known to be there, and not yet what was there at the start.
    """

    def __init__(self, longest):
        self._longest = longest
        self._state, self._changed = None, -math.inf

    def hear(self, state, now):
        """Its state at a time [s], as anything that can be compared; whether it counts as there."""
        if state != self._state:
            self._changed = now if self._state else -math.inf
            self._state = state
        return now - self._changed < self._longest


class JoyWatch:
    """Takes `joy`, hands on `joy/live`: the same, or a pad that nobody touches where it may be gone."""

    def __init__(self, parameters):
        self._parameters = parameters
        self._pads = {}           # StillPad by sender: what one of two tells is no sign of the other
        self._down = {}           # buttons of the newest message, by sender
        self._gone = {}           # senders of pads that may be out of reach, and when they were heard [s]
        self._gaps = Gaps(SILENCE, boot_time())  # of this process, behind which a release may be old
        self._heard = None
        self._stop = EmergencyStopPublisher()
        self._live = rospy.Publisher("joy/live", Joy, queue_size=1, tcp_nodelay=True)
        self._health = Health(robot_name(), {"gamepad": self._report})
        # each one counts: of those that wait together the newest alone may not have the button that was tapped
        rospy.Subscriber("joy", Joy, self._on_joy, queue_size=MOST_WAITING, tcp_nodelay=True)

    def _on_joy(self, message):
        given, now = self._parameters, boot_time()
        sender = connection_header(message).get("callerid", "")
        down = {number for number, pressed in enumerate(message.buttons) if pressed}
        both = {given["release_button"], given["dead_man_button"]}
        pressed, self._down[sender] = down - self._down.get(sender, both), down  # both down at first ask nothing
        pad = self._pads.setdefault(sender, StillPad(given["longest_still"]))
        there = pad.hear(repr((message.axes, message.buttons)), now)  # as text, for a NaN is like no other
        settled = self._gaps.settled(now)
        if given["stop_button"] in pressed:
            self._stop.press()
        elif pressed & both and both <= down:
            if settled:
                self._stop.release()
            else:
                rospy.logwarn("not released: nothing was heard of the gamepad for a while; ask again")
        before = bool(self._gone)
        self._gone[sender] = now if down and not there else -math.inf
        self._gone = {one: at for one, at in self._gone.items() if now - at < SILENT}  # of one that has ended: no more
        if not there:
            message.axes, message.buttons = [0.0] * len(message.axes), [0] * len(message.buttons)
        self._live.publish(message)
        self._heard = now
        if bool(self._gone) != before:
            self._health.publish_now()

    def _report(self):
        if self._heard is None or boot_time() - self._heard > SILENT:
            return WARN, "no gamepad: plug one in; may this user read it?", {}
        if self._gone:
            return WARN, "the gamepad is still, or out of reach: move a stick", {}
        return OK, "a gamepad", {}


def main():
    """Run joy_watch."""
    run_without_wheels("joy_watch", JoyWatch, PARAMETERS)

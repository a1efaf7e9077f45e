"""The ROS side of goto: an action client of move_base that shows progress, and whose exit status is the outcome."""

import argparse
import math
import signal
import sys
import threading
import time
from typing import NamedTuple

import actionlib
import rosgraph
import rospy
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

from robotont_driver.se2 import pose_of
from robotont_navigation.goal import (
    INTERRUPTED,
    NOT_THERE,
    REPLACED,
    TOO_LONG,
    Goal,
    Outcome,
    outcome,
    progress,
    protect_negative,
    read_coordinate,
    read_seconds,
    read_yaw,
)

SILENCE = 3.0      # [s] without a status of move_base, which sends five per second, and it is gone
CANCELLING = 5.0   # [s] that move_base has to confirm a cancellation
TERMINAL_PERIOD, LOG_PERIOD = 0.2, 2.0  # [s] between two lines of progress on a terminal and in a file
EXIT_STATUS = """exit status: 0 reached; 1 move_base gave up; 2 wrong arguments; 3 no move_base, or it died;
4 another goal took its place; 5 --timeout; 130 Ctrl-C (the goal is cancelled first)"""


class Pursuit(NamedTuple):
    """A goal that has been sent."""

    goal: Goal
    start: float  # [s] time.monotonic() when it was sent


class GoTo:
    """Sends a goal and watches it; the next one replaces it."""

    def __init__(self, frame, show):
        self._frame = frame
        self._show = show
        self._pose = None
        self._ended = threading.Event()
        self._ended.set()  # nothing is pursued yet
        self._left = False
        self._heard = -math.inf
        self._client = actionlib.SimpleActionClient("move_base", MoveBaseAction)
        rospy.Subscriber("move_base/status", GoalStatusArray, self._on_status, queue_size=1)

    @property
    def answers(self):
        """Whether move_base has been heard lately."""
        return time.monotonic() - self._heard <= SILENCE

    def wait_for_server(self, timeout):
        """Whether move_base answers within `timeout` [s]."""
        end = time.monotonic() + timeout
        while not self._client.wait_for_server(rospy.Duration(0.2)):
            if time.monotonic() > end:
                return False
        return True

    def go(self, goal, timeout):
        """Send the robot to a Goal; its Outcome, after `timeout` [s] at the latest (0: no limit)."""
        return self.follow(self.send(goal), timeout)

    def send(self, goal):
        """Send the robot to a Goal, in place of the one before; a Pursuit to follow."""
        message = MoveBaseGoal()
        target = message.target_pose
        target.header.frame_id, target.header.stamp = self._frame, rospy.Time.now()
        target.pose.position.x, target.pose.position.y = goal.x, goal.y
        target.pose.orientation.z, target.pose.orientation.w = math.sin(goal.yaw / 2), math.cos(goal.yaw / 2)
        self._heard = time.monotonic()
        self._pose = None
        self._ended.clear()
        self._left = False
        self._client.send_goal(message, done_cb=self._on_done, feedback_cb=self._on_feedback)
        return Pursuit(goal, self._heard)

    def follow(self, pursuit, timeout):
        """The Outcome of the goal that was sent last, after `timeout` [s] at the latest (0: no limit)."""
        goal, start = pursuit
        try:
            while not self._ended.wait(0.1):
                now = time.monotonic()
                self._show(progress(self._pose, goal, now - start))
                if now - self._heard > SILENCE:
                    self._client.cancel_goal()  # should it only be slow
                    return Outcome(NOT_THERE, f"move_base has not been heard for {SILENCE:g} s: has it died?")
                if timeout and now - start > timeout:
                    return Outcome(TOO_LONG, f"not there after {timeout:g} s; {self.cancel()}")
        except KeyboardInterrupt:
            return Outcome(INTERRUPTED, f"interrupted; {self.cancel()}")
        if self._left:
            return Outcome(REPLACED, "cancelled")
        return outcome(GoalStatus.to_string(self._client.get_state()), self._client.get_goal_status_text(), goal,
                       self._pose, time.monotonic() - start)

    def leave(self, cancel=False):
        """Make `follow` return, from another thread; the robot goes on to its goal unless that is to `cancel`."""
        if cancel and not self._ended.is_set():
            self._client.cancel_goal()
        self._left = True
        self._ended.set()

    def cancel(self):
        """Take the goal back; returns a sentence on whether move_base has confirmed it."""
        self._client.cancel_goal()
        if self._ended.wait(CANCELLING):
            return "the goal is cancelled"
        return "move_base does not confirm that the goal is cancelled"

    def _on_status(self, _message):
        self._heard = time.monotonic()

    def _on_feedback(self, feedback):
        pose = feedback.base_position.pose
        self._pose = Goal(*pose_of(pose))

    def _on_done(self, _state, _result):
        self._ended.set()


class Display:
    """Lines of progress: one that changes on a terminal, one every LOG_PERIOD elsewhere."""

    def __init__(self):
        self._terminal = sys.stdout.isatty()
        self._shown = 0.0

    def show(self, line):
        """Print a line of progress when it is time."""
        now = time.monotonic()
        if now - self._shown >= (TERMINAL_PERIOD if self._terminal else LOG_PERIOD):
            self._shown = now
            print(f"\r\033[K{line}" if self._terminal else line, end="" if self._terminal else "\n", flush=True)

    def end(self, line, file):
        """Print the last line, below the progress."""
        if self._terminal and self._shown:
            print(flush=True)
        print(line, file=file, flush=True)


def _argument(read):
    """`read` for argparse, which shows the message of its own error only."""
    def parse(text):
        try:
            return read(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
    return parse


def parse_arguments(words):
    """Options of the command line; exits with status 2 and a message when it is wrong."""
    parser = argparse.ArgumentParser(prog="goto", description="Send the robot to a place on the map by move_base.",
                                     epilog=EXIT_STATUS, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("x", type=_argument(read_coordinate), help="[m]")
    parser.add_argument("y", type=_argument(read_coordinate), help="[m]")
    parser.add_argument("yaw", type=_argument(read_yaw), help="where to look in the end [rad]")
    parser.add_argument("--frame", default="map", help="frame of x, y and yaw [%(default)s]")
    parser.add_argument("--timeout", type=_argument(read_seconds), default=0.0,
                        help="cancel after this long, 0: never [s] [%(default)s]")
    parser.add_argument("--wait", type=_argument(read_seconds), default=30.0,
                        help="for move_base to come up [s] [%(default)s]")
    return parser.parse_args(protect_negative(words))


def run(options, display):
    """Outcome of the goal that the options describe."""
    if not rosgraph.is_master_online():
        return Outcome(NOT_THERE, f"no ROS master at {rosgraph.get_master_uri()}: is roslaunch running?")
    rospy.init_node("goto", anonymous=True, disable_signals=True)
    goal = Goal(options.x, options.y, options.yaw)
    goto = GoTo(options.frame, display.show)
    name = rospy.resolve_name("move_base")
    if not goto.wait_for_server(0.5):
        print(f"waiting for {name}", flush=True)
        if not goto.wait_for_server(options.wait):
            return Outcome(NOT_THERE, f"no {name} after {options.wait:g} s: is navigation.launch running?")
    print(f"going to {goal} in {options.frame}", flush=True)
    return goto.go(goal, options.timeout)


def main():
    """Run goto; returns the exit status."""
    def interrupt(_signal, _frame):
        raise KeyboardInterrupt
    signal.signal(signal.SIGTERM, interrupt)
    options = parse_arguments(rospy.myargv()[1:])
    display = Display()
    try:
        end = run(options, display)
    except KeyboardInterrupt:  # before there was a goal
        end = Outcome(INTERRUPTED, "interrupted")
    display.end(end.words, sys.stdout if end.status == 0 else sys.stderr)
    return end.status

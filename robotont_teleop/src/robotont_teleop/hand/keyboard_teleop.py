"""Drives the robot by the keys of a terminal."""

import contextlib
import math
import os
import select
import signal
import sys
import termios
import tty

import rospy

from robotont_driver.command.command_age import SILENCE as GAP
from robotont_driver.command.command_age import Gaps
from robotont_driver.link.boot_clock import boot_time
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.lifecycle import answer_help, own_parameters
from robotont_driver.rospy_repairs.rospy_process import NoMasterError, end_soon, init_tool
from robotont_teleop.hand.emergency_stop_publisher import EmergencyStopPublisher
from robotont_teleop.hand.held_keys import EMERGENCY_STOP, QUIT, RELEASE, HeldKeys, keys_of_now, split_keys
from robotont_teleop.hand.robot_reports import SILENCE, RobotReports
from robotont_teleop.hand.speeds import STOP, Speeds
from robotont_teleop.hand.twist_publisher import TwistPublisher

PARAMETERS = (
    Parameter("linear_speed", 0.3, "of a held key, at the start", "m/s", minimum=0.01, maximum=100.0),
    Parameter("angular_speed", 1.0, "likewise", "rad/s", minimum=0.01, maximum=100.0),
    Parameter("first_hold", 0.75, "how long one press drives; longer than the keyboard's delay before it repeats", "s",
              minimum=0.1, maximum=2.0,
              reason="for so long one press drives"),
)
FASTEST = Speeds(1.0, 3.0)  # that keys can reach, where they do not begin beyond
TOPIC = "cmd_vel/hand"
PUBLISH_PERIOD = 0.05  # [s] between commands while the robot is driven
REPEAT_HOLD = 0.3    # [s] for which a held key drives on after its last repeat
MOST_WAITING = 65536  # [bytes] of a terminal: the rest would look like keys of now
HELP = """\
hold to drive             speed              the robot stops when no key is held
  q  w  e  turn, ahead      +  -  all
  a  s  d  strafe, back     r  f  driving      space    emergency stop
  arrows   drive and turn   t  g  turning      Ctrl-U  release it
keys add up (a, then q: strafe and turn)
the opposite key stops first, then reverses
Ctrl-C or Esc: end
below: the speeds of a held key [m/s] [rad/s], then x y turn of what is sent,
who the mux lets drive, and how the robot moves; while keys drive, instead:
an error, a silence, or a warning of the guard"""


class KeyboardTeleop:
    """Reads keys from file descriptor `terminal`, publishes, and shows a line on standard output."""

    def __init__(self, parameters, terminal):
        self._terminal = terminal
        self._gaps = Gaps(GAP, -math.inf)  # of this process, its start is one: a key that came meanwhile is old
        speeds = Speeds(parameters["linear_speed"], parameters["angular_speed"])
        self._keys = HeldKeys(speeds, Speeds(*map(max, speeds, FASTEST)), parameters["first_hold"], REPEAT_HOLD)
        self._stop = EmergencyStopPublisher()  # first: on a slow network each takes seconds
        self._command = TwistPublisher(TOPIC)
        self._reports = RobotReports()
        self._sent = STOP
        self._rest = ""
        self._unknown = False  # whether the newest key means nothing, outside a stop

    def run(self):
        """Drive until a key, a signal or the end of the terminal ends it; returns the reason. Never raises OSError."""
        try:
            while not rospy.is_shutdown():
                for key in self._read():
                    if key in QUIT:
                        return "ended by key"
                    self._take(key)
                self._send()
                self._show()
            return "ROS has shut down"
        except OSError:
            return "the terminal is gone"
        finally:
            self.stop()

    def stop(self):
        """Zero, in case that it is the last that goes out."""
        if not rospy.is_shutdown():
            self._publish(STOP)

    def _read(self):
        """Keys that have come within one period; raises OSError when there is no terminal any more."""
        there = select.select([self._terminal], [], [], PUBLISH_PERIOD)[0]
        settled = self._gaps.settled(boot_time())
        if not settled:
            self._keys.release()  # it may have been let go meanwhile
        if not there:
            return []
        data = os.read(self._terminal, MOST_WAITING)
        if not data:
            raise OSError("end of the terminal")
        keys, self._rest = split_keys(self._rest + data.decode("utf-8", "surrogateescape"))
        return keys_of_now(keys, settled)

    def _take(self, key):
        self._unknown = False
        if key == EMERGENCY_STOP:
            self._keys.release()
            self._stop.press()
            self._publish(STOP)
        elif key == RELEASE:
            self._keys.release()
            self._stop.release()
        elif not self._stop.pressed:
            self._unknown = not self._keys.press(key, boot_time())

    def _send(self):
        """The command of now: at once when it changes, repeated while it is not zero."""
        if self._stop.pressed:
            self._keys.release()
        twist = self._keys.twist(boot_time())
        if twist != STOP or self._sent != STOP:
            self._publish(twist)

    def _publish(self, twist):
        self._sent = twist
        self._command.send(twist)

    def _show(self):
        words = "STOP, BUT THE ROBOT HAS NOT CONFIRMED IT" if self._stop.waits else \
            f"EMERGENCY STOP, {self._releaser()} releases it" if self._stop.pressed else _words(self._sent)
        velocity, driver = self._reports.velocity, self._reports.driven_by or "?"
        robot = "no odometry" if velocity is None else _words(velocity)
        line = f"{self._keys.speeds.linear:.2f} {self._keys.speeds.angular:.2f} | "
        line += (self._sent != STOP and self._trouble()) or f"sent {words} | mux: {driver} | robot {robot}"
        if self._stop.pressed:
            pass  # nothing hides it
        elif not self._command.get_num_connections():  # a robot that was started anew has another master
            line = f"no mux hears {rospy.resolve_name(TOPIC)}: keys again, keys __ns:=/NAME, or start_mux:=true"
        elif self._unknown and self._sent == STOP:
            line = "this key does nothing: another keyboard layout? Use the letters above, or arrows"
        columns = os.get_terminal_size(sys.stdout.fileno()).columns if sys.stdout.isatty() else 0
        _write(f"\r{line[:columns - 1] if columns > 1 else line}\x1b[K")

    def _releaser(self):
        return "the class's page" if "/fleet_node" in self._stop.pressed_by else "Ctrl-U"

    def _trouble(self):
        """The worst error, silence or warning of the guard, in its own words; it may not concern the motion."""
        worst = next((light for light in self._reports.lights
                      if light["level"] > 1 or (light["level"] and light["name"].endswith(": guard"))), None)
        return worst and (f"{worst['name']} is silent" if worst["level"] == SILENCE else worst["words"])


def _write(text):
    """Show it, unless the terminal takes nothing, as after Ctrl-S: whoever waited would hear no key either."""
    screen = sys.stdout.fileno()
    os.set_blocking(screen, False)  # for this write alone: the shell has the same terminal
    try:
        with contextlib.suppress(BlockingIOError):
            os.write(screen, text.encode())
    finally:
        os.set_blocking(screen, True)


def _words(twist):
    return "{:+.2f} {:+.2f} {:+.2f}".format(*(round(value, 2) + 0.0 for value in twist))


def main():
    """Run keyboard_teleop; the terminal is left as it was."""
    answer_help("keyboard_teleop", (__doc__ or "") + "\n\n" + HELP + "\n\nof a robot with a namespace: "
                "__ns:=/NAMESPACE", PARAMETERS)
    if not sys.stdin.isatty():
        sys.exit("keyboard_teleop: no terminal to read keys from: start it by rosrun in a terminal, not by roslaunch")
    try:
        init_tool("keyboard_teleop")
    except NoMasterError as error:
        sys.exit(f"keyboard_teleop: {error}")
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _end)
    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    teleop = KeyboardTeleop(own_parameters(PARAMETERS), terminal)
    why = "ended"

    def listen(*_):
        with contextlib.suppress(termios.error):  # no terminal any more
            tty.setcbreak(terminal, termios.TCSANOW)  # what was typed meanwhile stays: it may be a stop
    signal.signal(signal.SIGCONT, listen)  # behind Ctrl-Z and fg, for which the shell has changed the terminal
    try:
        listen()
        print(HELP, flush=True)
        why = teleop.run()
    except KeyboardInterrupt:
        teleop.stop()
    finally:
        for number in (signal.SIGHUP, signal.SIGCONT):
            signal.signal(number, signal.SIG_IGN)
        try:
            termios.tcsetattr(terminal, termios.TCSADRAIN, before)
            print(f"\n{why}; no key drives the robot any more", flush=True)
        except (OSError, termios.error):  # no terminal any more
            sys.stdout = open(os.devnull, "w")  # noqa: SIM115  discards the rest of its buffer
        end_soon()
        rospy.signal_shutdown(why)


def _end(_number, _frame):
    raise KeyboardInterrupt

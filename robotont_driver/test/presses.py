"""driver_nodes on a robot, and buttons of the emergency stop on a laptop behind a network that is slow or cut."""

import re
import signal
import time

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.robots import WHEEL_PARAMS
from robotont_testing.two_machines import TwoMachines

GOOD = (0.01, 0.0)  # delay [s] each way, share that is lost

# argv: topic, file of orders. Each line: a word to publish once, or "WORD RATE" for ever, until the next line.
BUTTON = """
import os, sys, time, rospy
from std_msgs.msg import Bool
rospy.init_node("button", disable_signals=True)
def say(word):  # whole lines, by whichever thread
    os.write(1, f"{time.monotonic()} {word}\\n".encode())
class Listener(rospy.SubscribeListener):
    def peer_subscribe(self, *_):
        say("connected")
say("started")
publisher = rospy.Publisher(sys.argv[1], Bool, Listener(), queue_size=10, tcp_nodelay=True)
say("registered")
done, repeated, due = 0, None, 0.0
while not rospy.is_shutdown():
    lines = open(sys.argv[2]).read().split("\\n")[:-1]
    for word, *rate in map(str.split, lines[done:]):
        repeated = (word, 1 / float(rate[0])) if rate else None
        due = time.monotonic()
        if not rate:
            say(word)
            publisher.publish(word == "true")
    done = len(lines)
    if repeated and time.monotonic() >= due:
        publisher.publish(repeated[0] == "true")
        due = time.monotonic() + repeated[1]
    time.sleep(0.01)
say("ended")  # the master has: what its predecessor, killed, had sent to the master came later than its own
"""

# argv: namespaces. Prints who presses, as each driver_node says at each change.
LISTENER = """
import os, sys, time, rospy
from std_msgs.msg import String
rospy.init_node("listener", disable_signals=True)
for robot in sys.argv[1:]:
    rospy.Subscriber(f"/{robot}/emergency_stop/pressed_by", String, lambda message, robot=robot:
                     os.write(1, f"{time.monotonic()} {robot} {message.data.replace(', ', ',')}\\n".encode()))
rospy.spin()
"""


class Presses(TwoMachines):
    """Robots by name, each a driver_node, on the machine with the master; buttons elsewhere."""

    def __init__(self, robots):
        super().__init__(slow=True)
        self._buttons, self._orders, self._starts = {}, {}, 0
        self.on("robot", "rosmaster", "--core", "-p", "11311", **self.environment("robot"))
        wait_for(lambda: not self.run("robot", "rosparam", "list", **self.environment("robot")).returncode, "a master")
        for robot in robots:
            self.run("robot", "rosparam", "load", WHEEL_PARAMS, robot, **self.environment("robot")).check_returncode()
            self.on("robot", places.program("robotont_driver", "driver_node"), f"__ns:={robot}",
                    log=self.folder / f"{robot}.log", **self.environment("robot"))
        self._heard = self.folder / "pressed_by"
        self._listener = self.on("robot", "/usr/bin/python3", "-c", LISTENER, *robots, log=self._heard,
                                 **self.environment("robot"))
        wait_for(lambda: len({robot for _, robot, *_ in self.heard()}) == len(robots), "the robots", timeout=60.0)

    def close(self):
        """End all, at once."""
        self.kill_buttons()
        self.stop(self._listener, signal.SIGKILL)
        super().close()

    def heard(self):
        """(time [s], robot, names that press) of each change."""
        lines = self._heard.read_text().split("\n")[:-1] if self._heard.exists() else []
        return [(float(at), robot, names.split(",") if names else [])
                for at, robot, names in (line.split(" ") for line in lines)]

    def pressing(self, robot="robot0"):
        """Names of those that press now."""
        return [names for _, one, names in self.heard() if one == robot][-1]

    def order(self, button, words):
        """Let a button say a word, or a word at a rate [Hz]: "true 5"."""
        with open(self._orders[button], "a") as file:
            file.write(words + "\n")

    def start_button(self, button, robot="robot0", words=""):
        """Start a button, a node of that name, and maybe let it say something; at its first start or again."""
        self.kill_button(button)
        self._starts += 1
        self._orders[button] = self.folder / f"orders.{self._starts}"
        self._orders[button].write_text(words and words + "\n")
        log = self.folder / f"button.{self._starts}"
        process = self.on("laptop", "/usr/bin/python3", "-c", BUTTON, f"/{robot}/emergency_stop", self._orders[button],
                          f"__name:={button}", log=log, **self.environment("laptop"))
        self._buttons[button] = process, log

    def kill_button(self, button, how=signal.SIGKILL):
        """End a button, without a word to anybody."""
        if button in self._buttons:
            self.stop(self._buttons.pop(button)[0], how)

    def kill_buttons(self):
        """All of them."""
        for button in list(self._buttons):
            self.kill_button(button)

    def said(self, button):
        """(time [s], word) of all that a button has done since its start: started, registered, connected, words."""
        lines = self._buttons[button][1].read_text()  # among those that rospy writes of its own
        return [(float(at), word) for at, word in re.findall(r"^(\d+\.\d+) (\w+)\n", lines, re.MULTILINE)]

    def when(self, button, word):
        """[s] when a button has done that first; None: not yet."""
        return next((at for at, one in self.said(button) if one == word), None)

    def wait_for_connection(self, button):
        """Until a robot is connected to a button."""
        wait_for(lambda: self.when(button, "connected"), "the connection", timeout=90.0)

    def wait_for_press(self, button, robot="robot0", timeout=60.0):
        """[s] when a robot has heard the press of a button that is waited for."""
        def at():
            name = f"/{button}"
            return next((at for at, one, names in self.heard() if one == robot and name in names), None)
        return wait_for(at, f"the press of {button}", timeout)

    def wait(self, seconds):
        """Let time pass that a history is made of."""
        time.sleep(seconds)

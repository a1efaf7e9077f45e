"""What a robot says of itself on its topics: its health, speed, battery and who drives it."""

import contextlib
import math

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String

from robotont_driver.kinematics.se2 import pose_of
from robotont_driver.link.boot_clock import boot_time
from robotont_driver.robots.battery import LOW
from robotont_teleop.hand.fault_keys import fault_key

STALE = 1.0      # [s] a value that has not come for so long is not shown
SILENT = 5.0     # [s] a task or a battery that has not come for so long is silent
FORGOTTEN = 60.0  # [s] ... and then no more
LEVELS, SILENCE = (0, 1, 2), 3  # of diagnostic_msgs/DiagnosticStatus; and beside them
SILENT_LIGHT = {"level": SILENCE, "words": f"silent for over {SILENT:g} s", "key": "silent"}
LONGEST_WAY = 0.5  # [m] between two poses; beyond, the odometry was reset
MOST, LONGEST_NAME, LONGEST_WORDS, MOST_VALUES = 96, 80, 200, 100


class RobotReports:
    """The newest of all that, of the robot in this node's namespace; calls never wait."""

    def __init__(self):
        namespace = rospy.get_namespace().strip("/")
        self._prefix = namespace and namespace + "/"
        self._others = set()  # prefixes of other robots' nodes, for which "hardware" is the robot
        self._tasks = {}      # name: (time [s], light, {key: number})
        self._newest = {}     # name: (time [s], value) of values that become stale
        self._place = None    # of the newest odometry
        self.base_frame = ""  # as the odometry names it
        self.driven = 0.0     # [m]
        self.newest_charge = None  # of the battery, 0 to 1, however long ago
        rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=1)
        rospy.Subscriber("battery", BatteryState, self._on_battery, queue_size=1)
        self._driven_by = ""
        self._mux = rospy.Subscriber("cmd_vel/driven_by", String, self._on_driven_by, queue_size=1)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics, queue_size=50)

    @property
    def velocity(self):
        """(v_x [m/s], v_y [m/s], omega [rad/s]) of the odometry, or None."""
        return self._fresh("velocity")

    @property
    def driven_by(self):
        """Who drives, as the mux says; "" where there is none."""
        return self._driven_by if self._mux.get_num_connections() else ""

    @property
    def battery(self):
        """{"voltage" [V], "charge" (1: full)}, each None where it is unknown; None without a battery."""
        return self._fresh("battery", SILENT)

    @property
    def lights(self):
        """[{"name", "level", "words", "key"}] of all tasks, the worst first, for JSON; key: of the fault, or ""."""
        found = [light for light, _ in self._now()]
        charge = (self.battery or {}).get("charge")
        if charge is not None and charge <= LOW and all(light["key"] != "battery_low" for light in found):
            found.append({"name": "battery", "level": 1, "words": f"{charge:.0%} left", "key": "battery_low"})
        return worst_first(found)

    @property
    def worst(self):
        """The first of `lights` as {"level", "task", "words", "fault"}; None without any."""
        first = next(iter(self.lights), None)
        return first and dict(zip(("task", "level", "words", "fault"), first.values()))

    @property
    def summary(self):
        """How it is, for JSON: what its page, the fleet and /metrics tell alike; nothing of it is old."""
        velocity = self.velocity
        speed = velocity and (math.hypot(*velocity[:2]), velocity[2])
        return {"speed": rounded(speed, 3), "driven": round(self.driven, 2), "battery": self.battery,
                "driven_by": self.driven_by, "worst": self.worst}

    @property
    def values(self):
        """{task: {"level", key: number}}."""
        return {light["name"]: {"level": light["level"], **values} for light, values in self._now()}

    def _now(self):
        now, tasks, others = boot_time(), dict(self._tasks), tuple(self._others)  # copies: others write meanwhile
        return [(light if now - at < SILENT else {**light, **SILENT_LIGHT}, values)
                for name, (at, light, values) in sorted(tasks.items()) if not name.startswith(others)]

    def _keep(self, name, value):
        self._newest[name] = boot_time(), value

    def _fresh(self, name, within=STALE):
        at, value = self._newest.get(name, (-math.inf, None))
        return value if boot_time() - at < within else None

    def _on_odometry(self, message):
        twist, place = message.twist.twist, pose_of(message.pose.pose)[:2]
        way = math.dist(place, self._place or place)
        self.driven += way if way < LONGEST_WAY else 0.0
        self._place, self.base_frame = place, message.child_frame_id
        velocity = twist.linear.x, twist.linear.y, twist.angular.z
        if all(map(math.isfinite, velocity)):
            self._keep("velocity", velocity)

    def _on_battery(self, message):
        self.newest_charge = finite(message.percentage, 2) if 0.0 <= message.percentage <= 1.0 else None
        self._keep("battery", {"voltage": finite(message.voltage, 1), "charge": self.newest_charge})

    def _on_driven_by(self, message):
        self._driven_by = message.data[:LONGEST_WORDS]

    def _on_diagnostics(self, message):
        now = boot_time()
        tasks = self._tasks
        for name in [name for name, task in dict(tasks).items() if now - task[0] > FORGOTTEN]:
            tasks.pop(name, None)
        for status in message.status[:MOST]:
            name = status.name.lstrip("/")[:LONGEST_NAME]
            robot = status.hardware_id[:LONGEST_NAME].strip("/") + "/"
            if name.startswith(robot) and robot != self._prefix and len(self._others) < MOST:
                self._others.add(robot)
            foreign = not name.startswith(self._prefix) or name.startswith(tuple(self._others))
            if foreign or not (name in tasks or len(tasks) < MOST):
                continue
            level = status.level if status.level in LEVELS else SILENCE
            words, numbers = status.message[:LONGEST_WORDS], {}
            key = "silent" if level == SILENCE else fault_key(name, words) if level else ""
            for value in status.values[:MOST_VALUES]:
                with contextlib.suppress(ValueError, IndexError):  # words
                    numbers[value.key[:LONGEST_NAME]] = float(value.value[:40].split()[0])
            tasks[name] = now, {"name": name, "level": level, "words": words, "key": key}, numbers


def worst_first(lights):
    """Lights in the order in which a person should look at them: errors, silence, warnings, the rest."""
    return sorted(lights, key=lambda light: (2, 3, 1, 0).index(min(light["level"], SILENCE)))


def rounded(values, decimals):
    """List of the values, None for those that are not finite; None for None."""
    return None if values is None else [finite(value, decimals) for value in values]


def finite(value, decimals):
    """The value rounded, or None where it is not finite."""
    return round(value, decimals) if value is not None and math.isfinite(value) else None

"""The ROS side of odom_node: serial_read in; odom, TF and joint_states out."""

import math
import threading
import time

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger, TriggerResponse

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.least_squares import SOLVERS
from robotont_driver.odometry.command_watch import CommandWatch
from robotont_driver.odometry.gyro import Gyro
from robotont_driver.odometry.gyro_fusion import GyroFusion
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.odometry.slip import SlipDetector
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.clocks import boot_time, read_clocks
from robotont_driver.ros.diagnostics import OK, WARN, Health, Rate, robot_name
from robotont_driver.ros.imu_input import ImuInput
from robotont_driver.ros.kept_pose import KeptPose
from robotont_driver.ros.lifecycle import Part, init_node, serve
from robotont_driver.ros.log_throttle import Refusals
from robotont_driver.ros.packet_topics import topics_between_processes
from robotont_driver.ros.publishers import DroppingPublisher
from robotont_driver.timing.packet_clock import SECOND, ArrivalClock, PacketClock

# Variance of z, roll and pitch (and their rates): a robot on the floor has none; filters like no zeros.
FLAT = 1e-6
# Where x, y and yaw stand in the 6 x 6 covariances of ROS (x, y, z, roll, pitch, yaw; row by row).
PLANAR = [6 * row + column for row in (0, 1, 5) for column in (0, 1, 5)]

# [s] Without a newer command for this long, serial_com_node and the board have stopped the robot.
COMMAND_AGE = 0.5

GYRO_BIAS_DRIFT = 7e-5   # [rad/s] how far a gyro's bias walks in 1 s, growing with the square root of the time
RECENTLY = 10 * SECOND  # [ns] for which the diagnostics warn that the clock was set

PARAMETERS = (
    Parameter("odom_frame", "odom", "frame of the pose", official="odom/frame"),
    Parameter("base_frame", "base_link", "frame of the twist, and the child frame of the transform",
              official="odom/child_frame"),
    Parameter("publish_tf", True, "whether to publish odom_frame -> base_frame; false with an EKF"),
    Parameter("packet_period", -1.0, "time that one packet stands for; negative = 1/pidControlFrequency; "
              "0 = packets contain speeds, measure the time between them", "s", minimum=-1.0, maximum=10.0),
    Parameter("solver", "least_squares", "step of the robot from n wheels: least_squares, or triples, the mean over "
              "every combination of three wheels", choices=("least_squares", "triples")),
    Parameter("wheel_noise", 0.012, "standard deviation of a wheel's path after 1 m, growing with the "
              "square root of the path", "m", minimum=0.0, maximum=1.0,
              reason="wheels whose error exceeds their path measure nothing"),
    Parameter("slip_false_alarms", 0.1, "false alarms per hour of driving that the search for slipping wheels may "
              "raise at most (4 or more wheels, or a gyro); 0 = no search", "1/h", minimum=0.0,
              maximum=1000.0),
    Parameter("imu", "", "topic of a gyro (sensor_msgs/Imu) that takes part in the heading; empty: none"),
    Parameter("gyro_noise", 2.5e-4, "density of the gyro's noise", "rad/s/sqrt(Hz)", minimum=1e-7, maximum=1.0),
    Parameter("gyro_scale", 1.0, "rate that the gyro reports when the robot turns at 1 rad/s", "rad/s", minimum=0.5,
              maximum=2.0, reason="a gyro that is farther off is broken"),
    Parameter("gyro_scale_noise", 0.01, "standard deviation of gyro_scale; once it is calibrated 3e-4", "rad/s",
              minimum=0.0, maximum=0.5),
    Parameter("joint_names", "", "names of the wheel joints in the wheel file's order, between blanks; empty: "
              "wheel_0_joint, ..."),
    Parameter("run", "", "set by odom_node itself: started again with the same one, it goes on from its newest pose"),
    Parameter("joint_prefix", "", "put before the names of the wheel joints"),
)


class OdomNode:
    """Publishes one odometry message, transform and joint state per packet.

    name: full name of the node. topics: `PacketTopics`.
    """

    def __init__(self, name, wheels, parameters, topics):
        self._wheels = wheels
        kinematics = Kinematics(wheels, SOLVERS[parameters["solver"]])
        period = 1.0 / wheels.pid_frequency if parameters["packet_period"] < 0 else parameters["packet_period"]
        noise, false_alarms = parameters["wheel_noise"], parameters["slip_false_alarms"]
        self._clock = PacketClock(period) if period else ArrivalClock()
        self._gyro = None
        if parameters["imu"] and period:
            self._gyro = GyroFusion(
                Gyro(period, parameters["gyro_noise"], GYRO_BIAS_DRIFT, parameters["gyro_scale"],
                     parameters["gyro_scale_noise"]), false_alarms)
        self._odometry = WheelOdometry(kinematics, period, noise, self._gyro)
        self._kept = KeptPose(name, parameters["run"], boot_time())
        if self._kept.found:
            self._odometry.pose.resume(*self._kept.found[:2])
            rospy.logwarn("odom_node goes on from where it was %.1f s ago", self._kept.found.gap)
        self._detector = self._watch = None  # packets of speeds (period 0) are no measurement
        if period and wheels.amount > 3 and false_alarms:
            self._detector = SlipDetector(
                kinematics.matrix, wheels.metres_per_edge, noise, false_alarms, 1.0 / period)
        if period:
            self._watch = CommandWatch(wheels.amount, 1.0 / period)
        self._commanded_at = 0.0   # [s] when the newest packet came on serial_write
        self._commanded = None     # its units
        self._lock = threading.Lock()
        self._arrived = None  # [ns] newest packet, on the steady clock
        self._packets = 0
        self._refusals = Refusals()  # of malformed messages on serial_read
        self._rate = Rate()
        self._prepare_messages(parameters)
        self._broadcaster = tf2_ros.TransformBroadcaster() if parameters["publish_tf"] else None
        self._odom_publisher = DroppingPublisher("odom", Odometry)
        self._joint_publisher = DroppingPublisher("joint_states", JointState)
        rospy.Service("reset_odometry", Trigger, self._on_reset)
        # no queue_size: every packet counts
        topics.serial_read.subscribe(wheels.amount, self._on_packet, self._on_refused)
        if period:
            topics.serial_doubt.subscribe(wheels.amount, self._on_doubt, self._on_refused)
        if self._watch:
            topics.serial_write.subscribe(wheels.amount, self._on_command, self._on_refused_command, queue_size=1)
        subjects = {"wheel feedback": self._report, "stamps": self._report_stamps}
        if self._gyro:
            self._imu = ImuInput(parameters["imu"], parameters["base_frame"], self._gyro, self._lock)
            subjects["gyro"] = self._imu.report
        self._health = Health(robot_name(), subjects, name)

    def _prepare_messages(self, parameters):
        """Messages with all that never changes; each packet fills in the rest."""
        self._odom = Odometry(child_frame_id=parameters["base_frame"])
        self._odom.header.frame_id = parameters["odom_frame"]
        self._transform = TransformStamped(child_frame_id=parameters["base_frame"])
        self._transform.header.frame_id = parameters["odom_frame"]
        self._joints = JointState(name=[
            parameters["joint_prefix"] + name for name in joint_names(parameters["joint_names"], self._wheels.amount)])
        self._stamp = rospy.Time()  # of all three messages
        for message in (self._odom, self._transform, self._joints):
            message.header.stamp = self._stamp
        for covariance in (self._odom.pose.covariance, self._odom.twist.covariance):
            covariance[:] = [FLAT if index % 7 == 0 else 0.0 for index in range(36)]

    def _on_refused(self, error):
        if self._refusals.refuse(error.kind, time.monotonic()):
            rospy.logwarn("serial_read refused: %s", error)

    def _on_packet(self, counts):
        with self._lock:
            arrival, now = read_clocks()
            elapsed = 0.0 if self._arrived is None else (arrival - self._arrived) / 1e9
            self._arrived = arrival
            alarms = self._alarms()
            stamp = self._clock.stamp(arrival, now)
            if self._detector and self._detector.update(counts, self._newest_command()):
                self._odometry.exclude(self._detector.slipping)
            self._odometry.update(counts, elapsed, stamp)
            self._packets += 1
            self._publish(stamp)
            pose = self._odometry.pose
            self._kept.keep((pose.x, pose.y, pose.yaw), pose.covariance, self._odometry.twist, boot_time())
            if self._watch:  # the diagnostics can wait, the odometry need not
                self._watch.update(counts, self._newest_command())
            changed = self._alarms() != alarms
        if changed:
            self._report_change()

    def _on_doubt(self, edges):
        with self._lock:
            self._odometry.doubt(edges)

    def _alarms(self):
        """State whose changes the diagnostics report at once."""
        return (self._clock.event_at, self._detector.slipping if self._detector else (), self._gyro_suspects())

    def _report_change(self):
        self._health.publish_now()
        suspects = self._gyro_suspects()
        if suspects:
            rospy.logwarn_throttle(1.0, "%s", self._suspicion(suspects))

    def _gyro_suspects(self):
        return self._gyro.watch.suspects if self._gyro and self._gyro.watch else ()

    def _on_command(self, command):
        self._commanded_at = time.monotonic()
        self._commanded = command

    def _on_refused_command(self, _error):
        self._commanded = None  # serial_com_node complains of it

    def _newest_command(self):
        """Units that the board follows now; None without a command that is still valid."""
        return self._commanded if time.monotonic() - self._commanded_at < COMMAND_AGE else None

    def _publish(self, nanoseconds):
        self._stamp.secs, self._stamp.nsecs = divmod(nanoseconds, SECOND)
        odometry, pose = self._odometry, self._odometry.pose
        odom, joints, transform = self._odom, self._joints, self._transform.transform
        position, orientation = odom.pose.pose.position, odom.pose.pose.orientation
        position.x = transform.translation.x = pose.x
        position.y = transform.translation.y = pose.y
        orientation.z = transform.rotation.z = math.sin(pose.yaw / 2)
        orientation.w = transform.rotation.w = math.cos(pose.yaw / 2)
        odom.twist.twist.linear.x, odom.twist.twist.linear.y, odom.twist.twist.angular.z = odometry.twist
        fill(odom.pose.covariance, odometry.pose_covariance)
        fill(odom.twist.covariance, odometry.twist_covariance)
        self._odom_publisher.publish(odom)
        if self._broadcaster:
            self._broadcaster.sendTransform(self._transform)
        joints.position = odometry.wheel_angles
        joints.velocity = odometry.wheel_rates
        self._joint_publisher.publish(joints)

    def _on_reset(self, _request):
        with self._lock:
            self._odometry.pose.reset()
        return TriggerResponse(success=True, message="odometry is at the origin again")

    def _report(self):
        with self._lock:
            rate = self._rate.look(self._packets, time.monotonic())
            values = {
                "packets per second": f"{rate:.1f}",
                "packets": self._packets,
                "packets refused": self._refusals.amount,
            }
            slipping = self._detector.slipping if self._detector else ()
            lagging = self._watch.lagging if self._watch else ()
            followed = self._watch.followed if self._watch else None
            alarms = self._detector.alarms if self._detector else 0
            suspects = self._gyro_suspects()
        found = self._kept.found
        values["went on from an earlier pose"] = f"after {found.gap:.1f} s without odometry" if found else "no"
        values["wheels compared by"] = self._comparison()
        values["wheels excluded"] = list_wheels(slipping) or "none"
        values["wheels excluded so far"] = alarms
        if self._detector:
            values["noise of the wheels, learnt"] = f"{self._detector.noise.ratio:.1f} x wheel_noise"
        for wheel, share in enumerate(followed or ()):
            values[f"wheel {wheel}: part of the commanded path"] = "at rest" if share is None else f"{share:.0%}"
        if rate == 0.0:
            return WARN, "no packets on serial_read, the odometry stands still: see the diagnostics of the link", values
        if slipping:
            return WARN, (f"{list_wheels(slipping)} disagrees with the others and is excluded from the odometry: "
                          "look for a slipping or blocked wheel, a loose coupling, an unplugged encoder"), values
        if suspects:
            return WARN, self._suspicion(suspects), values
        if lagging:
            return WARN, (f"{list_wheels(lagging)} does not turn as commanded: look for a blocked wheel, a loose "
                          "motor or encoder cable, an empty battery" + self._warning()), values
        return OK, f"{rate:.0f} packets/s", values

    def _comparison(self):
        """The comparisons that the search for slip is based on."""
        if self._gyro:
            return "the gyro, and " + ("each other, " if self._detector else "") + "command and measurement"
        if self._detector:
            return "each other, and command and measurement"
        return "command and measurement only" if self._watch else "nothing (packets of speeds)"

    def _suspicion(self, suspects):
        """Message about a disagreement of wheels and gyro."""
        if len(suspects) == self._wheels.amount:
            return ("the gyro measures another turn than the wheels: the robot is pushed, lifted or carried, or a "
                    "wheel slips or is blocked")
        names = " or ".join(f"wheel {wheel}" for wheel in suspects)
        return f"{names} slips: the gyro measures another turn than the wheels"

    def _report_stamps(self):
        with self._lock:
            clock, arrived = self._clock, self._arrived
            values = {
                "drift of the board's clock": f"{1e6 * clock.drift:+.0f} ppm",
                "packets later than their number implies": clock.shifts,
                "times that the clock was set": clock.steps,
                "restarts": clock.restarts,
                "newest time that the clock was set": clock.event or "never",
            }
            recently = clock.event and arrived - clock.event_at < RECENTLY
        if recently:
            return WARN, clock.event + "; odometry, transforms and joint states go on with its new time", values
        return OK, "by packet number and arrival" if self._odometry.period else "by arrival", values

    def _warning(self):
        """Hint that three wheels have no redundancy; empty where there is some."""
        if self._wheels.amount > 3 or self._gyro:
            return ""
        return "; with 3 wheels only command and measurement can be compared, and the odometry goes on with all"


def joint_names(given, wheels):
    """Names of the joints: those `given` between blanks, or wheel_0_joint, ...

    Exits with a message when their number is not that of the wheels.
    """
    names = given.split() or [f"wheel_{wheel}_joint" for wheel in range(wheels)]
    if len(names) != wheels:
        rospy.logfatal("wrong parameter ~joint_names: found %r, allowed: %d names between blanks", given, wheels)
        raise SystemExit(1)
    return names


def list_wheels(wheels):
    """Wheels by index, as text; empty for none."""
    return "wheel " + ", ".join(map(str, wheels)) if wheels else ""


def fill(numbers, covariance):
    """Put a Covariance into a message's list of 36."""
    for index, value in zip(PLANAR, covariance.rows):
        numbers[index] = value


def check(_wheels, parameters, _other):
    """List of conflicts between parameters."""
    frames = parameters["odom_frame"], parameters["base_frame"]
    if all(frames) and frames[0] != frames[1]:
        return []
    return [f"~odom_frame and ~base_frame: found {frames[0]!r} and {frames[1]!r}, allowed: two different names"]


def part(name, topics):
    """odom_node as a part of a process."""
    return Part(name, lambda wheels, parameters: OdomNode(name, wheels, parameters, topics), PARAMETERS, check)


def main():
    """Run odom_node."""
    init_node("odom_node", __doc__, PARAMETERS)
    serve(part(rospy.get_name(), topics_between_processes()))

"""The ROS side of odom_node: serial_read in; odom, TF and joint_states out."""

import math
import threading
import time

import rospy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_srvs.srv import Empty, EmptyResponse, Trigger, TriggerResponse
from tf2_msgs.msg import TFMessage

from robotont_driver.kinematics.kinematics import SOLVERS, Kinematics
from robotont_driver.link.boot_clock import boot_time
from robotont_driver.odometry.gyro import Gyro
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.odometry.odometry_stamps import LARGEST_DRIFT, SECOND, OdometryStamps
from robotont_driver.odometry.slip import SlipSearch
from robotont_driver.parameters.parameters import Parameter, ParameterError, fault
from robotont_driver.ros.diagnostics import OK, WARN, Health, Rate, robot_name
from robotont_driver.ros.imu_input import ImuInput
from robotont_driver.ros.kept_pose import KeptPose
from robotont_driver.rospy_repairs.dropping_publisher import DroppingPublisher

GYRO_BIAS_DRIFT = 7e-5   # [rad/s] how far a gyro's bias walks in 1 s, growing with the square root of the time
GYRO_SCALE_NOISE, GYRO_SCALE_NOISE_CALIBRATED = 0.01, 3e-4  # [rad/s] at 1 rad/s; docs/odometry.md
# Rows of z, roll and pitch (and their rates): a robot on the floor has no variance there; filters like no zeros.
FLAT = (0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-6, 0.0)
LONGEST_READING = 1_000_000  # [ns] that reading two clocks may take; longer, and something came between
RECENTLY = 10 * SECOND  # [ns] for which the diagnostics warn that the clock was set

PARAMETERS = (
    Parameter("odom_frame", "odom", "frame of the pose", official="odom/frame"),
    Parameter("base_frame", "base_link", "frame of the twist, and the child frame of the transform",
              official="odom/child_frame"),
    Parameter("publish_tf", True, "whether to publish odom_frame -> base_frame; false with an EKF"),
    Parameter("packet_period", -1.0, "time that one packet stands for; negative = 1/pidControlFrequency; "
              "0 = packets contain speeds, measure the time between them", "s", minimum=-1.0, maximum=10.0),
    Parameter("solver", "least_squares", "step of the robot from n wheels: least_squares, or triples, the mean over "
              "well conditioned combinations of three wheels", choices=("least_squares", "triples")),
    Parameter("wheel_noise", 0.012, "standard deviation of a wheel's path after 1 m, growing with the "
              "square root of the path", "m/sqrt(m)", minimum=0.0, maximum=1.0,
              reason="wheels whose error exceeds their path measure nothing"),
    Parameter("slip_limit", 6.0, "standard deviations by which a wheel may disagree with the others, or with a "
              "gyro, over 0.5 s; beyond, it slips (three wheels need the gyro); 0 = no search", "",
              minimum=0.0, maximum=100.0),
    Parameter("imu", "", "topic of a gyro (sensor_msgs/Imu) for the heading, with its mounting in TF; empty, or with "
              "packet_period 0: none"),
    Parameter("gyro_noise", 2.5e-4, "density of the gyro's noise", "rad/s/sqrt(Hz)", minimum=1e-7, maximum=1.0),
    Parameter("gyro_scale", 1.0, "rate that the gyro reports when the robot turns at 1 rad/s", "rad/s", minimum=0.5,
              maximum=2.0, reason="a gyro that is farther off is broken"),
    Parameter("joint_names", "", "names of the wheel joints in the wheel file's order, between blanks; empty: "
              "wheel_0_joint, ..."),
    Parameter("joint_prefix", "", "put before the names of the wheel joints"),
)


class OdomNode:
    """Publishes one odometry message, transform and joint state per packet."""

    def __init__(self, name, wheels, parameters, topic):
        frames = parameters["odom_frame"], parameters["base_frame"]
        if not all(frames) or frames[0] == frames[1]:
            raise ParameterError([f"~odom_frame and ~base_frame: found {frames[0]!r} and {frames[1]!r}, allowed: two "
                                  "different names"])
        kinematics = Kinematics(wheels, SOLVERS[parameters["solver"]])
        period = 1.0 / wheels.pid_frequency if parameters["packet_period"] < 0 else parameters["packet_period"]
        noise, scale = parameters["wheel_noise"], parameters["gyro_scale"]
        self._clock = OdometryStamps(period)
        self._gyro = self._search = None  # packets of speeds (period 0) are no measurement
        if parameters["imu"] and period:
            self._gyro = Gyro(period, wheels.metres_per_edge, parameters["gyro_noise"], GYRO_BIAS_DRIFT, scale,
                                    GYRO_SCALE_NOISE if scale == 1.0 else GYRO_SCALE_NOISE_CALIBRATED)
        if period:
            self._search = SlipSearch(kinematics, period, noise, parameters["slip_limit"])
        self._odometry = WheelOdometry(kinematics, period, noise, self._gyro)
        self._kept = KeptPose(name, boot_time())
        if self._kept.gap is not None:
            self._odometry.pose.resume(self._kept.pose, self._kept.covariance)
            rospy.logwarn("odom_node goes on from where it was %.1f s ago", self._kept.gap)
        self._lock = threading.Lock()
        self._arrived = None  # [ns] newest packet, on the steady clock
        self._packets = 0
        self._rate = Rate(time.monotonic())
        self._messages = OdometryMessages(parameters, wheels.amount)
        rospy.Service("reset_odometry", Trigger, self._on_reset)
        rospy.Service("odom_reset", Empty, lambda _: self._on_reset(_) and EmptyResponse())  # as robotont_fake_driver
        self._read = topic("serial_read")
        self._read.subscribe(wheels.amount, self._on_packet)  # no queue_size: every packet counts
        subjects = {"wheel feedback": self._report, "stamps": self._report_stamps}
        if self._gyro:
            self._imu = ImuInput(parameters["imu"], parameters["base_frame"], self._gyro, self._lock)
            subjects["gyro"] = self._imu.report
        Health(robot_name(), subjects, name)

    def _on_packet(self, packet):
        with self._lock:
            odometry, search = self._odometry, self._search
            arrival, now = read_clocks()
            stamp = self._clock.stamp(arrival, now, packet.number)
            elapsed = 0.0 if self._arrived is None else (arrival - self._arrived) / 1e9
            odometry.update(packet, elapsed, stamp, search and search.slips, packet.periods)
            pose = odometry.pose
            self._arrived = arrival
            self._packets += 1
            covariance = odometry.pose_covariance
            self._messages.publish(odometry, covariance, stamp)
            self._kept.keep((pose.x, pose.y, pose.yaw), covariance, odometry.twist, boot_time())
            if search and search.update(packet, packet.commanded, self._gyro and self._gyro.compared):
                odometry.exclude(search.slipping)

    def _on_reset(self, _request):
        with self._lock:
            self._odometry.pose.reset()
        return TriggerResponse(success=True, message="odometry is at the origin again")

    def _report(self):
        with self._lock:
            rate, search, gap = self._rate.look(self._packets, time.monotonic()), self._search, self._kept.gap
            values = {
                "packets per second": f"{rate:.1f}",
                "packets": self._packets,
                "packets refused": self._read.refused,
                "went on from an earlier pose": "no" if gap is None else f"after {gap:.1f} s without odometry",
            }
            if search:
                values.update({
                    "wheels excluded": f"wheel {search.slipping[0]}" if search.slipping else "none",
                    "noise of the wheels, learnt": f"{math.sqrt(search.noise):.1f} x wheel_noise",
                })
            fault = fault_of_wheels(search) if search else ""
        if rate == 0.0:
            return WARN, "no packets on serial_read, the odometry stands still: see the diagnostics of the link", values
        return (WARN, fault, values) if fault else (OK, f"{rate:.0f} packets/s", values)

    def _report_stamps(self):
        with self._lock:
            clock = self._clock
            values = {
                "drift of the board's clock": f"{1e6 * clock.drift:+.0f} ppm",
                "restarts": clock.restarts,
                "newest time that the clock was set": clock.event or "never",
            }
            recently = clock.event and self._arrived - clock.event_at < RECENTLY
        if not rospy.get_time():
            return WARN, "use_sim_time is set, and nobody publishes /clock: all stamps are 0", values
        if abs(clock.drift) >= LARGEST_DRIFT:
            return WARN, (f"periods are {100 * clock.drift:+.0f} % off those of pidControlFrequency, or more: "
                          "stamps may be a period off"), values
        if recently:
            return WARN, clock.event + "; odometry, transforms and joint states go on with its new time", values
        return OK, "by the count of packets and arrival" if self._odometry.period else "by arrival", values


class OdometryMessages:
    """Made once, with all that never changes; each packet fills in the rest. parameters: those of odom_node."""

    def __init__(self, parameters, wheels):
        self._odom = Odometry(child_frame_id=parameters["base_frame"])
        self._odom.header.frame_id = parameters["odom_frame"]
        self._transform = TransformStamped(child_frame_id=parameters["base_frame"])
        self._transform.header.frame_id = parameters["odom_frame"]
        self._joints = JointState(name=[
            parameters["joint_prefix"] + name for name in joint_names(parameters["joint_names"], wheels)])
        self._stamp = rospy.Time()  # of all three messages
        for message in (self._odom, self._transform, self._joints):
            message.header.stamp = self._stamp
        self._transforms = TFMessage([self._transform])
        self._tf_publisher = DroppingPublisher("/tf", TFMessage) if parameters["publish_tf"] else None
        self._odom_publisher = DroppingPublisher("odom", Odometry)
        self._joint_publisher = DroppingPublisher("joint_states", JointState)

    def publish(self, odometry, covariance, nanoseconds):
        """Publish a WheelOdometry and its pose's Covariance with a stamp [ns]."""
        self._stamp.secs, self._stamp.nsecs = divmod(nanoseconds, SECOND)
        pose, odom, joints, transform = odometry.pose, self._odom, self._joints, self._transform.transform
        position, orientation = odom.pose.pose.position, odom.pose.pose.orientation
        position.x = transform.translation.x = pose.x
        position.y = transform.translation.y = pose.y
        orientation.z = transform.rotation.z = math.sin(pose.yaw / 2)
        orientation.w = transform.rotation.w = math.cos(pose.yaw / 2)
        odom.twist.twist.linear.x, odom.twist.twist.linear.y, odom.twist.twist.angular.z = odometry.twist
        odom.pose.covariance = planar(covariance)
        odom.twist.covariance = planar(odometry.twist_covariance)
        self._odom_publisher.publish(odom)
        if self._tf_publisher:
            self._tf_publisher.publish(self._transforms)
        joints.position = odometry.wheel_angles
        joints.velocity = odometry.wheel_rates
        self._joint_publisher.publish(joints)


def fault_of_wheels(search):
    """The gravest fault that a SlipSearch has found; empty when there is none."""
    if search.slipping:
        return (f"wheel {search.slipping[0]} disagrees with the others and is excluded from the odometry: look for a "
                "slipping or blocked wheel, a loose coupling, an unplugged encoder")
    if search.alike:
        wheels = " or ".join(str(wheel) for wheel in search.alike if wheel < search.wheels)
        moved = ["the robot is pushed, lifted or carried"] if search.wheels in search.alike else []
        slips = [f"wheel {wheels} slips or is blocked"] if wheels else []
        return " or ".join(moved + slips) + ": the odometry goes on with all, its covariance grows"
    if search.lagging:
        return (f"wheel {search.lagging[0]} does not turn as commanded: look for a blocked wheel, a loose motor or "
                "encoder cable, an empty battery")
    return ""


def read_clocks():
    """(steady clock, ROS time) [ns] of one instant; simulated time is both."""
    if not rospy.rostime.is_wallclock():
        now = rospy.Time.now().to_nsec()
        return now, now
    while True:
        steady = time.monotonic_ns()
        now = time.time_ns()  # what rospy.Time.now() reads, too
        if time.monotonic_ns() - steady < LONGEST_READING:
            return steady, now


def joint_names(given, wheels):
    """Names of the joints: those `given` between blanks, or wheel_0_joint, ... Raises ParameterError."""
    names = given.split() or [f"wheel_{wheel}_joint" for wheel in range(wheels)]
    if len(names) != wheels:
        raise ParameterError([fault("~joint_names", given, f"{wheels} names between blanks")])
    return names


def planar(covariance):
    """The 36 numbers of a message (x, y, z, roll, pitch, yaw; row by row) for a Covariance."""
    xx, xy, xa, yy, ya, aa = covariance
    return [xx, xy, 0.0, 0.0, 0.0, xa, xy, yy, 0.0, 0.0, 0.0, ya, *FLAT, xa, ya, 0.0, 0.0, 0.0, aa]

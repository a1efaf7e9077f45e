"""The ROS side of a gyro: its samples, its orientation on the robot, and its part of the diagnostics."""

import math
import time

import rospy
import tf2_ros
from sensor_msgs.msg import Imu

from robotont_driver.odometry.gyro import LEARNING
from robotont_driver.ros.diagnostics import OK, WARN, Rate

BURST = 1000  # samples that may wait: 4 s at 250 Hz, on a machine that is late with everything
BEHIND, AHEAD = 0.5, 0.1  # [s] by which the stamps of a whole second may differ from this computer's clock
SLOWEST = 10.0  # [1/s] samples
PATIENCE = 5.0   # [s] of standing of which nothing was learnt
SETTLED = 0.5    # [s] without motion after which the robot stands


class ImuInput:
    """Takes the rates of a gyro to a `GyroFusion`, once TF has its orientation on the robot."""

    def __init__(self, topic, base_frame, fusion, lock):
        self._topic, self._base_frame, self._fusion, self._lock = topic, base_frame, fusion, lock
        self._frame = self._up = self._buffer = self._listener = None
        self._looked, self._trouble = 0.0, ""  # [s] when TF was asked last, and why it has no transform
        self._samples = self._refused = 0
        self._finite = True    # whether the newest sample was a number
        self._rate, self._missing = Rate(), Rate()
        self._second, self._least, self._behind = 0.0, math.inf, math.inf  # now, how far behind in it, and before it
        rospy.Subscriber(topic, Imu, self._on_imu, queue_size=BURST, tcp_nodelay=True)

    def _on_imu(self, message):
        if message.header.frame_id != self._frame or self._up is None:
            self._find(message.header.frame_id)
        self._samples += 1
        rates = message.angular_velocity
        if self._up is None or not self._fits_clock(message.header.stamp):
            return
        rate = rates.x * self._up[0] + rates.y * self._up[1] + rates.z * self._up[2]
        self._finite = math.isfinite(rate)
        if not self._finite:
            self._refused += 1
            return
        with self._lock:
            self._fusion.add(message.header.stamp.to_nsec(), rate)

    def _fits_clock(self, stamp):
        """Whether the stamps are of this computer's time: the least late of a second, for messages may wait."""
        now = rospy.get_time()
        self._least = min(self._least, now - stamp.to_sec())
        if not 0.0 <= now - self._second < 1.0:
            self._second, self._behind, self._least = now, self._least, math.inf
        return -AHEAD < min(self._behind, self._least) < BEHIND

    def _find(self, frame):
        """Look for the direction upwards in the gyro's frame, once a second until TF has it."""
        if frame == self._base_frame:
            self._frame, self._up = frame, (0.0, 0.0, 1.0)
            return
        if frame == self._frame and time.monotonic() - self._looked < 1.0:
            return
        self._frame, self._up, self._looked = frame, None, time.monotonic()
        if self._buffer is None:
            self._buffer = tf2_ros.Buffer()
            self._listener = tf2_ros.TransformListener(self._buffer)
        try:
            turned = self._buffer.lookup_transform(self._base_frame, frame, rospy.Time(0)).transform.rotation
        except tf2_ros.TransformException as error:
            self._trouble = str(error)
            return
        x, y, z, w = turned.x, turned.y, turned.z, turned.w
        self._up = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)  # last row of its matrix
        self._listener.unregister()  # the gyro is fixed to the robot; listening to all of /tf is costly
        self._buffer = self._listener = None

    def report(self):
        """The gyro's task of the diagnostics."""
        fusion = self._fusion
        with self._lock:
            now = time.monotonic()
            rate, missing = self._rate.look(self._samples, now), self._missing.look(fusion.missing, now)
            bias, agreement = fusion.bias, fusion.agreement
            values = {
                "samples per second": f"{rate:.1f}",
                "samples refused": self._refused,
                "gaps": fusion.gaps,
                "bias": f"{math.degrees(bias.value):+.4f} deg/s, uncertain by "
                        f"{math.degrees(math.sqrt(bias.variance)):.4f} deg/s",
                "turned": f"{math.degrees(fusion.turned):.2f} deg",
                "turn for one of the wheels": f"{1 + agreement.error:.3f}" if agreement.judged else "none yet",
                "stamps late by": f"{agreement.delay:+.3f} s" if agreement.delay else "not known yet",
                "packets without": fusion.missing,
            }
            words = self._fault(rate, missing)
        if words:
            return WARN, f"{words}; the heading comes from the wheels alone", values
        if fusion.saturates:
            most = math.degrees(fusion.saturates)
            return WARN, f"measures no more than {most:.0f} deg/s: beyond that the wheels stand in", values
        return OK, "takes part in the heading", values

    def _fault(self, rate, missing):
        """Why the gyro is not used, in words, or nothing. rate, missing: [1/s] samples, packets without its turn."""
        fusion, late = self._fusion, min(self._behind, self._least)
        way = "behind" if late > 0 else "ahead of"
        reasons = (
            (rate == 0.0, f"no samples on {self._topic}"),
            (self._up is None, f"TF has no transform from {self._frame!r} to {self._base_frame}: {self._trouble}; "
                               "publish it, e.g. with static_transform_publisher"),
            (late > rospy.get_time() - 1.0, "its stamps are zero"),
            (not -AHEAD < late < BEHIND, f"its stamps are {abs(late):.1f} s {way} this computer's clock"),
            (rate < SLOWEST, f"{rate:.0f} samples per second, at least {SLOWEST:.0f} are needed"),
            (not self._finite, "its samples are no finite numbers"),
            (fusion.agreement.refused, fusion.agreement.refused),
            (fusion.bias.unsteady > PATIENCE, "its samples at rest are not steady: a wrong unit, vibrations, a "
                                              "gyro_noise that is too small, or it is turned by hand"),
            (not fusion.bias.ready, f"let the robot stand for {SETTLED + LEARNING:g} s: the bias is learnt then"),
            (missing > 0.5 / fusion.period, "its samples come too late, or with gaps"),
        )
        return next((words for holds, words in reasons if holds), "")

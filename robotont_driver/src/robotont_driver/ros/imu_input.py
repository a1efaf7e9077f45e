"""The ROS side of a gyro: its samples, its orientation on the robot, and its part of the diagnostics."""

import math
import time

import rospy
import tf2_ros
from sensor_msgs.msg import Imu

from robotont_driver.odometry.gyro import LEARNING, SETTLING
from robotont_driver.ros.diagnostics import OK, WARN, Rate

BURST = 1000  # samples that may wait: 4 s at 250 Hz, on a machine that is late with everything


class ImuInput:
    """Takes the rates of a gyro to a `GyroFusion`, once TF has its orientation on the robot."""

    def __init__(self, topic, base_frame, fusion, lock):
        self._topic, self._base_frame, self._fusion, self._lock = topic, base_frame, fusion, lock
        self._frame = self._up = None
        self._buffer = self._listener = None
        self._looked = 0.0     # [s] when TF was asked last
        self._trouble = ""     # why TF has no transform
        self._samples = 0
        self._refused = 0
        self._rate = Rate()
        rospy.Subscriber(topic, Imu, self._on_imu, queue_size=BURST, tcp_nodelay=True)

    def _on_imu(self, message):
        if message.header.frame_id != self._frame or self._up is None:
            self._find(message.header.frame_id)
        self._samples += 1
        if self._up is None:
            return
        rates = message.angular_velocity
        rate = rates.x * self._up[0] + rates.y * self._up[1] + rates.z * self._up[2]
        if not math.isfinite(rate):
            self._refused += 1
            return
        with self._lock:
            self._fusion.integral.add(message.header.stamp.to_nsec(), rate)

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
        fusion, gyro = self._fusion, self._fusion.gyro
        ratio = fusion.agreement.per_turn
        with self._lock:
            rate = self._rate.look(self._samples, time.monotonic())
            values = {
                "samples per second": f"{rate:.1f}",
                "samples refused": self._refused,
                "gaps": fusion.integral.gaps,
                "bias": f"{math.degrees(gyro.bias):+.4f} deg/s, uncertain by "
                        f"{math.degrees(math.sqrt(gyro.bias_variance)):.4f} deg/s",
                "turned": f"{math.degrees(fusion.turned):.2f} deg",
                "turn for one of the wheels": "none yet" if ratio is None else f"{ratio:.2f}",
                "packets without": fusion.missing,
                "times that wheels and gyro disagreed": fusion.watch.alarms if fusion.watch else "not watched",
            }
        if rate == 0.0:
            return WARN, f"no samples on {self._topic}: the heading comes from the wheels alone", values
        if self._up is None:
            return WARN, (f"TF has no transform from {self._frame!r} to {self._base_frame}: {self._trouble}; "
                          "publish it, e.g. with static_transform_publisher"), values
        if fusion.agreement.refused:
            return WARN, (f"measures {ratio:.2f} turns for one of the wheels and is not used: look for a wrong sign, "
                          "axis or frame (TF), a wrong gyro_scale, wheels that slip, a wrong wheel file"), values
        if not gyro.ready:
            return OK, f"let the robot stand for {SETTLING + LEARNING:g} s: the bias is learnt then", values
        return OK, "takes part in the heading", values

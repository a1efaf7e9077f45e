"""A gyro's ROS side: samples, its orientation on the robot by TF, its part of the diagnostics."""

import math
import time

import rospy
import tf2_ros
from sensor_msgs.msg import Imu

from robotont_driver.ros.diagnostics import OK, WARN, Rate

BURST = 1000  # samples that may wait: 4 s at 250 Hz, on a machine that is late with everything


class ImuInput:
    """Takes the rates of a gyro to a `Gyro`, once TF has its orientation on the robot."""

    def __init__(self, topic, base_frame, gyro, lock):
        self._topic, self._base_frame, self._gyro, self._lock = topic, base_frame, gyro, lock
        self._frame = self._up = self._buffer = self._listener = None
        self._looked, self._trouble = 0.0, ""  # [s] when TF was asked last, and why it has no transform
        self._samples, self._rate = 0, Rate(time.monotonic())
        rospy.Subscriber(topic, Imu, self._on_imu, queue_size=BURST, tcp_nodelay=True)

    def _on_imu(self, message):
        if message.header.frame_id != self._frame or self._up is None:
            self._find(message.header.frame_id)
        self._samples += 1
        rates = message.angular_velocity
        if self._up is not None:
            rate = rates.x * self._up[0] + rates.y * self._up[1] + rates.z * self._up[2]
            with self._lock:
                self._gyro.add(message.header.stamp.to_nsec(), rate, rospy.Time.now().to_nsec())

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
        with self._lock:
            gyro, bias, agreement = self._gyro, self._gyro.bias, self._gyro.agreement
            rate, words = self._rate.look(self._samples, time.monotonic()), gyro.words(rospy.Time.now().to_nsec())
            values = {
                "samples per second": f"{rate:.1f}",
                "gaps": gyro.gaps,
                "bias": f"{math.degrees(bias.value):+.4f} deg/s, uncertain by "
                        f"{math.degrees(math.sqrt(bias.variance)):.4f} deg/s",
                "turned": f"{math.degrees(gyro.turned):.2f} deg",
                "turn for one of the wheels": f"{1 + agreement.error:.3f}" if agreement.judged else "none yet",
                "stamps late by": f"{agreement.delay:+.3f} s" if agreement.judged else "not known yet",
                "packets without": f"{gyro.without:.0%}",
            }
        if rate == 0.0:
            words = f"no samples on {self._topic}"
        elif self._up is None:
            words = (f"TF has no transform from {self._frame!r} to {self._base_frame}: {self._trouble}; publish it, "
                     "e.g. with static_transform_publisher")
        return (WARN, f"{words}; without it the heading comes from the wheels", values) if words else (
            OK, "takes part in the heading", values)

"""The simulated robot's depth camera, under the names of realsense2_camera. It renders what somebody listens to."""

import io
import math
import threading
import time

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped, Vector3
from nav_msgs.msg import Odometry
from PIL import Image as Picture
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from robotont_driver.kinematics import se2
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.lifecycle import run_node
from robotont_simulator import company
from robotont_simulator.camera import Camera
from robotont_simulator.mujoco_model import AWAY
from robotont_simulator.world import read_world

PARAMETERS = (
    Parameter("world", "", "file of the world, as of simulator_node"),
    Parameter("width", 424, "of the pictures", "pixels", minimum=16, maximum=1920),
    Parameter("height", 240, "of the pictures", "pixels", minimum=16, maximum=1080),
    Parameter("rate", 15.0, "pictures per second", "Hz", minimum=0.1, maximum=60.0),
    Parameter("field_of_view", 1.5708, "from the left to the right edge", "rad", minimum=0.1, maximum=3.0),
    Parameter("samples", 0, "per pixel: 4 smooths edges, for the angles of far tags, and takes three times as long",
              minimum=0, maximum=16),
    Parameter("frame_prefix", "", "before the names of frames"),
    company.ROBOTS,
)
COLOUR, DEPTH, ALIGNED = "camera/color", "camera/depth", "camera/aligned_depth_to_color"
TOPICS = {COLOUR + "/image_raw": Image, COLOUR + "/image_raw/compressed": CompressedImage,
          DEPTH + "/image_rect_raw": Image, ALIGNED + "/image_raw": Image,
          **{camera + "/camera_info": CameraInfo for camera in (COLOUR, DEPTH, ALIGNED)}}
LOOK = 0.2        # [s] after which it looks whether somebody listens by now
JPEG_QUALITY = 80


class CameraNode:
    """Renders in a thread of its own, to which the renderer belongs."""

    def __init__(self, _name, wheels, parameters):
        self._wheels, self._parameters = wheels, parameters
        self._truth = self._visitor = None
        self._others = {}  # (x, y) [m] of the other robots, by their place
        prefix = parameters["frame_prefix"] + "camera_"
        colour, depth = prefix + "color_optical_frame", prefix + "depth_optical_frame"
        self._frames = {COLOUR: colour, DEPTH: depth, ALIGNED: colour}
        self._broadcaster = tf2_ros.StaticTransformBroadcaster()
        self._broadcaster.sendTransform([optical(prefix + "link", frame) for frame in (colour, depth)])
        self._publishers = {name: rospy.Publisher(name, kind, queue_size=1) for name, kind in TOPICS.items()}
        rospy.Subscriber("simulator_node/visitor", Vector3, self._on_visitor)
        threading.Thread(target=self._run, daemon=True).start()

    def _wanted(self):
        """The topics to which somebody listens."""
        return [name for name, publisher in self._publishers.items() if publisher.get_num_connections()]

    def _on_visitor(self, message):
        self._visitor = (message.x, message.y) if math.isfinite(message.x + message.y) else None

    def _on_truth(self, message):
        self._truth = message._buff  # noqa: SLF001 read only when somebody listens

    def _run(self):
        """Sleep while nobody listens; else render at the rate, from the newest true pose."""
        parameters, camera, subscriber, due = self._parameters, None, None, 0.0
        while not rospy.is_shutdown():
            wanted = self._wanted()
            if not wanted:
                rospy.rostime.wallsleep(LOOK)
                continue
            if not subscriber:  # for good: rospy may miss a connection that is ended and made again
                subscriber = rospy.Subscriber("ground_truth/odom", rospy.AnyMsg, self._on_truth, queue_size=1)
            if not camera:
                try:
                    world, others = company.shared(read_world(parameters["world"]), parameters["robots"])
                    camera = Camera(self._wheels, world, parameters["width"], parameters["height"],
                                    parameters["field_of_view"], parameters["samples"])
                except (ImportError, OSError, ValueError, RuntimeError, AttributeError) as error:
                    rospy.logfatal("no camera: %s; sudo apt-get install libegl-mesa0 libosmesa6", error)
                    rospy.signal_shutdown("no camera")
                    return
                self._others = dict.fromkeys(range(len(others)), AWAY[:2])
                company.watch(others, lambda place, *where: self._others.update({place: where}))
            truth, self._truth = self._truth, None
            if truth:
                self._publish(camera, Odometry().deserialize(truth), wanted)
                due += 1 / parameters["rate"]
            due = max(due, time.monotonic() + 0.002)  # [s] what was late stays late
            rospy.rostime.wallsleep(due - time.monotonic())

    def _publish(self, camera, truth, wanted):
        """The pictures from where the robot truly was."""
        stamp = truth.header.stamp
        camera.move(se2.pose_of(truth.pose.pose), self._visitor, self._others.values())
        if any(name.startswith(COLOUR + "/image") for name in wanted):
            self._publish_colour(stamp, camera.colour())
        if DEPTH + "/image_rect_raw" in wanted or ALIGNED + "/image_raw" in wanted:
            depth = camera.depth()
            self._send(DEPTH, "/image_rect_raw", picture(depth, "16UC1"), stamp)
            self._send(ALIGNED, "/image_raw", picture(depth, "16UC1"), stamp)
        info = lens(self._parameters["width"], self._parameters["height"], camera.focal_length)
        for name in self._frames:
            self._send(name, "/camera_info", info, stamp)

    def _publish_colour(self, stamp, pixels):
        self._send(COLOUR, "/image_raw", picture(pixels, "rgb8"), stamp)
        if self._publishers[COLOUR + "/image_raw/compressed"].get_num_connections():
            data = io.BytesIO()
            Picture.fromarray(pixels).save(data, "JPEG", quality=JPEG_QUALITY)
            self._send(COLOUR, "/image_raw/compressed", CompressedImage(format="jpeg", data=data.getvalue()), stamp)

    def _send(self, camera, topic, message, stamp):
        message.header.stamp, message.header.frame_id = stamp, self._frames[camera]
        self._publishers[camera + topic].publish(message)


def optical(parent, child):
    """The static transform to an optical frame: z forward, x right, y down (REP 103)."""
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id = parent
    rotation = transform.transform.rotation
    rotation.x, rotation.y, rotation.z, rotation.w = -0.5, 0.5, -0.5, 0.5
    return transform


def picture(pixels, encoding):
    """The Image of an array of pixels."""
    height, width = pixels.shape[:2]
    return Image(height=height, width=width, encoding=encoding, step=pixels.strides[0], data=pixels.tobytes())


def lens(width, height, focal_length):
    """CameraInfo of a lens without distortion."""
    f, x, y = focal_length, (width - 1) / 2, (height - 1) / 2
    return CameraInfo(width=width, height=height, distortion_model="plumb_bob", D=[0.0] * 5,
                      K=[f, 0, x, 0, f, y, 0, 0, 1], R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                      P=[f, 0, x, 0, 0, f, y, 0, 0, 0, 1, 0])


def main():
    """Run camera_node."""
    run_node(CameraNode)

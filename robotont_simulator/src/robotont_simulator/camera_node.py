"""The simulated robot's depth camera, under the names of realsense2_camera: renders what somebody listens to."""

import functools
import io
import math
import time

import mujoco
import numpy as np
import rospy
from nav_msgs.msg import Odometry
from PIL import Image as Picture
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from robotont_driver.kinematics import se2
from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.lifecycle import run_node
from robotont_driver.ros.repeating_thread import RepeatingThread
from robotont_simulator.mujoco_model import BODY_GROUP, Scene
from robotont_simulator.surroundings import ROBOTS, watch, watch_visitor, world_of

PARAMETERS = (
    Parameter("world", "", "file of the world, as of simulator_node"),
    Parameter("width", 424, "of the pictures", "pixels", minimum=16, maximum=1920),
    Parameter("height", 240, "of the pictures", "pixels", minimum=16, maximum=1080),
    Parameter("rate", 15.0, "pictures per second", "Hz", minimum=0.1, maximum=60.0),
    Parameter("field_of_view", 1.5708, "from the left to the right edge", "rad", minimum=0.1, maximum=3.0),
    Parameter("samples", 0, "per pixel: 4 smooths edges, 16 serves the angles of far tags",
              minimum=0, maximum=16),
    Parameter("frame_prefix", "", "before the names of frames"),
    ROBOTS,
)
COLOUR, DEPTH, ALIGNED = "camera/color", "camera/depth", "camera/aligned_depth_to_color"
TOPICS = {COLOUR + "/image_raw": Image, COLOUR + "/image_raw/compressed": CompressedImage,
          DEPTH + "/image_rect_raw": Image, ALIGNED + "/image_raw": Image,
          **{camera + "/camera_info": CameraInfo for camera in (COLOUR, DEPTH, ALIGNED)}}
LOOK = 0.2        # [s] after which it looks whether somebody listens by now
JPEG_QUALITY = 80
NEAREST, FARTHEST = 0.3, 10.0  # [m] between which the camera measures depth
NOISE = 0.002   # [1/m] standard deviation of the depth, times its square: 2 mm at 1 m, 32 mm at 4 m
EDGE = 0.1      # part of the depth by which neighbours differ where one of the two lenses sees another thing


class Camera(Scene):
    """Renders for `Wheels` in a `World`; width and height [pixels], field_of_view: across [rad]; samples: per pixel.

    focal_length: [pixels]. Its renderer belongs to the thread that looks first.
    """

    def __init__(self, wheels, world, width, height, field_of_view, samples=0):
        super().__init__(wheels, world, painted=True)
        self.focal_length = width / 2 / math.tan(field_of_view / 2)
        self._finer, self._renderer = 2 if samples > 4 else 1, None  # OpenGL without a graphics card has 4 at most
        self._size = self._finer * height, self._finer * width
        self.mujoco_model.vis.global_.offheight, self.mujoco_model.vis.global_.offwidth = self._size
        self.mujoco_model.vis.quality.offsamples = samples // self._finer ** 2
        self.mujoco_model.cam_fovy[0] = 2 * math.degrees(math.atan(height / 2 / self.focal_length))
        self._option = mujoco.MjvOption()
        self._option.geomgroup[BODY_GROUP] = 0  # the lens sees nothing of its own robot
        self._random = np.random.default_rng()

    def look(self, pose):
        """From the robot at (x [m], y [m], yaw [rad]). Raises RuntimeError or ImportError without EGL and OSMesa."""
        self._renderer = self._renderer or mujoco.Renderer(self.mujoco_model, *self._size)
        self.move(pose)
        mujoco.mj_kinematics(self.mujoco_model, self.data)
        mujoco.mj_camlight(self.mujoco_model, self.data)
        self._renderer.update_scene(self.data, "camera", self._option)

    def colour(self):
        """The picture, height x width x 3, red, green, blue, 0 to 255."""
        self._renderer.disable_depth_rendering()
        return np.asarray(Picture.fromarray(self._renderer.render()).reduce(self._finer))

    def depth(self):
        """[mm] along the lens' axis, height x width of uint16; 0 where nothing can be measured."""
        self._renderer.enable_depth_rendering()
        return measured(self._renderer.render()[::self._finer, ::self._finer], self._random)


def measured(depth, random):
    """[mm] that the camera reports, uint16, for the true depth [m], both height x width."""
    steps = abs(np.diff(depth, axis=1)) > EDGE * depth[:, 1:]
    noise = random.standard_normal(depth.shape, np.float32)
    found = 1000 * (depth + NOISE * depth ** 2 * noise) + 0.5
    found[(depth < NEAREST) | (depth > FARTHEST)] = 0
    found[:, 1:][steps] = 0
    found[:, :-1][steps] = 0
    return found.astype(np.uint16)


class CameraNode:
    """Renders in a thread of its own."""

    def __init__(self, _name, wheels, parameters):
        world = world_of(parameters)
        self._others = world.others
        width, height, self._period = parameters["width"], parameters["height"], 1 / parameters["rate"]
        self._camera = Camera(wheels, world, width, height, parameters["field_of_view"], parameters["samples"])
        f, x, y = self._camera.focal_length, (width - 1) / 2, (height - 1) / 2
        self._info = CameraInfo(width=width, height=height, distortion_model="plumb_bob", D=[0.0] * 5,
                                K=[f, 0, x, 0, f, y, 0, 0, 1], R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                                P=[f, 0, x, 0, 0, f, y, 0, 0, 0, 1, 0])
        self._due, self._truth, self._frame = 0.0, None, parameters["frame_prefix"] + "camera_{}_optical_frame"
        self._publishers = {name: rospy.Publisher(name, kind, queue_size=1) for name, kind in TOPICS.items()}
        watch_visitor(self._camera.put)
        RepeatingThread(self._work)

    def _work(self):
        """Render what somebody listens to, at the rate, from the newest true pose; [s] to rest."""
        wanted = [name for name, publisher in self._publishers.items() if publisher.get_num_connections()]
        if not wanted:
            return LOOK
        if self._others is not None:
            watch(self._others, self._camera.put)
            keep = functools.partial(setattr, self, "_truth")  # raw: read only when somebody listens
            rospy.Subscriber("ground_truth/odom", rospy.AnyMsg, keep, queue_size=1)
            self._others = None
        truth, self._truth = self._truth, None
        if truth:
            self._publish(Odometry().deserialize(truth._buff), wanted)  # noqa: SLF001
            self._due += self._period
        now = time.monotonic()
        self._due = max(self._due, now + 0.002)  # [s] what was late stays late
        return self._due - now

    def _publish(self, truth, wanted):
        """What the camera sees from where the robot truly was."""
        self._camera.look(se2.pose_of(truth.pose.pose))
        colour, depth = map(functools.lru_cache(None), (self._camera.colour, self._camera.depth))  # rendered once
        for topic in wanted:
            lens, kind = "/".join(topic.split("/")[:2]), TOPICS[topic]
            if kind is CameraInfo:
                message = self._info
            elif kind is CompressedImage:
                data, message = io.BytesIO(), CompressedImage(format="jpeg")
                Picture.fromarray(colour()).save(data, "JPEG", quality=JPEG_QUALITY)
                message.data = data.getvalue()
            else:
                pixels, encoding = (colour(), "rgb8") if lens == COLOUR else (depth(), "16UC1")
                message = Image(height=pixels.shape[0], width=pixels.shape[1], encoding=encoding,
                                step=pixels.strides[0], data=pixels.tobytes())
            message.header.stamp = truth.header.stamp
            message.header.frame_id = self._frame.format("depth" if lens == DEPTH else "color")
            self._publishers[topic].publish(message)


def main():
    """Run camera_node."""
    run_node(CameraNode)

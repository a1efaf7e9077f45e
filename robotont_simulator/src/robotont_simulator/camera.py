"""The robot's depth camera: colour and depth of a world from a pose, by MuJoCo's renderer without a screen."""

import math

import mujoco
import numpy as np

from robotont_simulator.mujoco_model import AWAY, BODY_GROUP, build
from robotont_simulator.scenery import HEIGHT

NEAREST, FARTHEST = 0.3, 10.0  # [m] between which the camera measures depth
NOISE = 0.002   # [1/m] standard deviation of the depth, times its square: 2 mm at 1 m, 32 mm at 4 m
EDGE = 0.1      # part of the depth by which neighbours differ where one of the two lenses sees another thing


class Camera:
    """Renders for `Wheels` in a `World`; width and height [pixels], field_of_view: across [rad]; samples: per pixel.

    focal_length: [pixels]. Raises RuntimeError or ImportError where there is neither EGL nor OSMesa.
    """

    def __init__(self, wheels, world, width, height, field_of_view, samples=0):
        self.focal_length = width / 2 / math.tan(field_of_view / 2)
        upright = 2 * math.degrees(math.atan(height / 2 / self.focal_length))
        self._model = mujoco.MjModel.from_xml_string(build(wheels, world, (width, height, upright, samples)))
        self._data = mujoco.MjData(self._model)
        self._renderer = mujoco.Renderer(self._model, height, width)
        self._option = mujoco.MjvOption()
        self._option.geomgroup[BODY_GROUP] = 0  # the lens sees nothing of its own robot
        self._random = np.random.default_rng()

    def move(self, pose, visitor=None, others=()):
        """Put the robot at (x [m], y [m], yaw [rad]), the visitor at (x, y) [m], or away, and other robots likewise."""
        x, y, yaw = pose
        self._data.qpos[:7] = x, y, 0.0, math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
        self._data.mocap_pos[0] = (*visitor, HEIGHT / 2) if visitor else AWAY
        for number, (x, y) in enumerate(others):
            self._data.mocap_pos[1 + number] = x, y, 0.0
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._renderer.update_scene(self._data, "camera", self._option)

    def colour(self):
        """The picture, height x width x 3, red, green, blue, 0 to 255."""
        self._renderer.disable_depth_rendering()
        return self._renderer.render()

    def depth(self):
        """[mm] along the lens' axis, height x width of uint16; 0 where nothing can be measured."""
        self._renderer.enable_depth_rendering()
        return measured(self._renderer.render(), self._random)


def measured(depth, random):
    """[mm] that the camera reports, uint16, for the true depth [m], both height x width."""
    steps = abs(np.diff(depth, axis=1)) > EDGE * depth[:, 1:]
    noise = random.standard_normal(depth.shape, np.float32)
    found = 1000 * (depth + NOISE * depth ** 2 * noise) + 0.5
    found[(depth < NEAREST) | (depth > FARTHEST)] = 0
    found[:, 1:][steps] = 0
    found[:, :-1][steps] = 0
    return found.astype(np.uint16)

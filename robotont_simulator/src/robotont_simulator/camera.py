"""The robot's depth camera: colour and depth of a world from a pose, by MuJoCo's renderer without a screen."""

import math

import mujoco
import numpy as np

from robotont_simulator.mujoco_model import BODY_GROUP, build, move, put

NEAREST, FARTHEST = 0.3, 10.0  # [m] between which the camera measures depth
NOISE = 0.002   # [1/m] standard deviation of the depth, times its square: 2 mm at 1 m, 32 mm at 4 m
EDGE = 0.1      # part of the depth by which neighbours differ where one of the two lenses sees another thing


class Camera:
    """Renders for `Wheels` in a `World`; width and height [pixels], field_of_view: across [rad]; samples: per pixel.

    focal_length: [pixels]. Raises RuntimeError or ImportError where there is neither EGL nor OSMesa.
    """

    def __init__(self, wheels, world, width, height, field_of_view, samples=0):
        self.focal_length = width / 2 / math.tan(field_of_view / 2)
        self._model = model = mujoco.MjModel.from_xml_string(build(wheels, world, painted=True))
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.offsamples = samples
        model.cam_fovy[0] = 2 * math.degrees(math.atan(height / 2 / self.focal_length))
        self._data = mujoco.MjData(model)
        self._renderer = mujoco.Renderer(model, height, width)
        self._option = mujoco.MjvOption()
        self._option.geomgroup[BODY_GROUP] = 0  # the lens sees nothing of its own robot
        self._random = np.random.default_rng()

    def move(self, pose, others=()):
        """Put the robot at (x [m], y [m], yaw [rad]); others: (number, x, y) of `mujoco_model.put`."""
        move(self._data, pose)
        for other in others:
            put(self._data, *other)
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

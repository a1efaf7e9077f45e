"""The physics: body, wheels, motors, encoders, gyro and a laser scanner, moved on period by period."""

import math

import mujoco
import numpy as np

from robotont_description.geometry import laser_height
from robotont_driver.kinematics.se2 import between
from robotont_simulator.mujoco_model import FRICTION, TIMESTEP, VOLTAGE, WORLD_GROUP, Scene

JAMMED = 50.0      # [N m] friction of a wheel that something holds: more than any motor
PUSH_DURATION = 0.3  # [s] that a push takes
HYSTERESIS = 0.1  # edges, of the encoders' Hall sensors: a wheel that rests on an edge does not count to and fro
GRAVITY = 9.81  # [m/s^2]
# Of the three axes of the gyro [rad/s] and of the accelerometer [m/s^2]: noise per sqrt(Hz), standard deviations of the
# offset at the start and of the scale's error, walk of the offset per sqrt(s)
NOISE, BIAS, SCALE, DRIFT = np.repeat([
    (math.radians(0.014), 150e-6 * GRAVITY), (math.radians(0.5), 5e-3 * GRAVITY), (3e-4, 0.0), (1e-5, 1e-4)], 3, axis=1)


class ImuErrors:
    """Errors of a Bosch BMI055, as in Intel's D435i, at `rate` [Hz]; the same for the same generator and calls.

    Data sheet: gyro noise 0.014 deg/s/sqrt(Hz), zero-rate offset of 1 deg/s; accelerometer noise 150 ug/sqrt(Hz),
    zero-g offset 70 mg, of which a calibrated one keeps little. The walk of the biases and the error of the gyro's
    scale (1 % from the factory) are those that a gyro has after a calibration at about constant temperature.
    """

    def __init__(self, rate, generator):
        self._random, self._walk = generator, DRIFT / math.sqrt(rate)
        self.scale, self.bias = 1.0 + SCALE * generator.standard_normal(6), BIAS * generator.standard_normal(6)
        self.deviation = NOISE * math.sqrt(rate)  # of a single reading

    def measure(self, readings):
        """What the device reports for true ones: angular velocity [rad/s], acceleration [m/s^2], 6 numbers."""
        walk, noise = self._random.standard_normal((2, 6))
        self.bias = self.bias + self._walk * walk
        return self.scale * readings + self.bias + self.deviation * noise


class Simulation(Scene):
    """A robot with `Wheels` in a `World`. Deterministic for a seed and a sequence of calls.

    imu_rate: [Hz] of an inertial measurement unit: so many readings in a period as have the same whole number of steps
    of the physics, one at least. May be changed: voltage [V] of the battery; efforts, n, -1..1 of it on motors, 0 lets
    them coast; encoders, n, 1 good, 0 unplugged, -1 reversed; powered, n, whether a motor gets any current.
    """

    def __init__(self, wheels, world, seed=0, imu_rate=0.0):
        super().__init__(wheels, world)
        self.wheels, model = wheels, self.mujoco_model
        self.voltage = VOLTAGE
        self._steps = max(1, round(1.0 / wheels.pid_frequency / TIMESTEP))
        model.opt.timestep = 1.0 / wheels.pid_frequency / self._steps
        self._body = model.body("base_link").id
        joints = model.actuator_trnid[:, 0]
        self._angles, self._dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._brake, self._frictions = model.actuator_biasprm[:, 2].copy(), model.dof_frictionloss[self._dofs].copy()
        self.counters = np.random.default_rng(seed).integers(0, 0x10000, wheels.amount)  # 0..65535, from anywhere on
        self.encoders, self.powered = np.ones((2, wheels.amount), int)
        self.efforts, self._turned = np.zeros((2, wheels.amount))  # turned: edges since the start, as the encoders feel
        self._push_ends = self._owed = 0.0  # [s]; owed: passed on an official board, and not here
        readings = max(part for part in range(1, self._steps + 1)
                       if self._steps % part == 0 and part <= max(1, imu_rate / wheels.pid_frequency))
        self._imu_steps = self._steps // readings
        self.imu_interval = self._imu_steps * model.opt.timestep  # [s] between two readings
        self.imu_errors = ImuErrors(1 / self.imu_interval, np.random.default_rng([seed, 1]))
        self.imu_readings = []  # of the newest period, oldest first, as `ImuErrors.measure` returns them
        mujoco.mj_forward(model, self.data)

    @property
    def time(self):
        """[s] simulated since the start."""
        return self.data.time

    @property
    def inertia(self):
        """Mass [kg] and moment of inertia [kg m^2], about its centre of mass, of the robot with its wheels."""
        return tuple(self.data.crb[self._body][[9, 2]].tolist())

    def step(self):
        """One PID period."""
        self.data.ctrl[:] = self.efforts * self.powered * (self.voltage / VOLTAGE)
        # the driver leaves motors without current open, which neither turns nor brakes
        self.mujoco_model.actuator_biasprm[:, 2] = self._brake * self.powered * (self.efforts != 0)
        if self.time >= self._push_ends:
            self.data.xfrc_applied[self._body] = 0.0
        self.imu_readings = [self._read_imu() for _ in range(self._steps // self._imu_steps)]
        turned, before = self.data.qpos[self._angles] * self.wheels.edges_per_turn / (2 * math.pi), self._turned
        self._turned = np.clip(before, turned - HYSTERESIS, turned + HYSTERESIS)
        edges = (np.floor(self._turned) - np.floor(before)).astype(int)
        self.counters = (self.counters + self.encoders * edges) % 0x10000

    def turn(self, efforts, seconds):
        """Let time pass with efforts from -1 to 1; edges, integers, in it: the motors of a board of robotont_boards."""
        self.efforts[:] = efforts
        self._owed += seconds
        before = self.counters
        while self._owed > 0.5 / self.wheels.pid_frequency:
            self._owed -= 1.0 / self.wheels.pid_frequency
            self.step()
        return ((self.counters - before + 0x8000) % 0x10000 - 0x8000).tolist()

    def _read_imu(self):
        """Move on to the next reading of the inertial measurement unit: means since the one before, in base_link."""
        data = self.data
        orientation, velocity = data.qpos[3:7].copy(), data.qvel[:3].copy()
        mujoco.mj_step(self.mujoco_model, data, self._imu_steps)
        rotation, matrix = np.empty(3), np.empty(9)
        mujoco.mju_subQuat(rotation, data.qpos[3:7], orientation)
        mujoco.mju_quat2Mat(matrix, data.qpos[3:7])
        acceleration = (data.qvel[:3] - velocity) / self.imu_interval + (0.0, 0.0, GRAVITY)
        return self.imu_errors.measure(np.concatenate([
            rotation / self.imu_interval, matrix.reshape(3, 3).T @ acceleration]))

    def pose(self):
        """Ground truth of base_link: (x [m], y [m], yaw [rad])."""
        x, y, _, w, i, j, k = self.data.qpos[:7].tolist()
        return x, y, math.atan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))

    def twist(self):
        """Ground truth in base_link: (v_x [m/s], v_y [m/s], omega [rad/s])."""
        vx, vy, _ = between((0.0, 0.0, self.pose()[2]), (*self.data.qvel[:2].tolist(), 0.0))
        return vx, vy, float(self.data.qvel[5])

    def push(self, x, y, turn=0.0):
        """An impulse on the body in world axes: (x, y) [N s] and [N m s], during PUSH_DURATION.

        It takes the weight off the wheels meanwhile, as a person who carries the robot would: they slide and do not
        turn, the truth moves, the odometry does not see it.
        """
        weight = self.mujoco_model.body_subtreemass[self._body] * GRAVITY
        self.data.xfrc_applied[self._body] = (
            x / PUSH_DURATION, y / PUSH_DURATION, weight, 0, 0, turn / PUSH_DURATION)
        self._push_ends = self.time + PUSH_DURATION

    def carry(self, x, y, yaw):
        """Put the robot down at a pose [m, m, rad], at rest; the wheels have not turned."""
        self.move((x, y, yaw))
        self.data.qvel[:6] = 0.0

    def set_grip(self, parts):
        """Make wheels slippery: of each the part (0..1) of the normal friction."""
        model = self.mujoco_model
        for wheel, part in enumerate(parts):
            rollers = model.body_parentid[model.geom_bodyid] == model.body(f"hub{wheel}").id
            model.geom_friction[rollers, 0] = max(FRICTION * part, 1e-3)

    def set_jam(self, held):
        """Hold wheels fast, or let them go, n."""
        self.mujoco_model.dof_frictionloss[self._dofs] = np.where(held, JAMMED, self._frictions)

    def scan(self, angles, nearest, farthest):
        """[m] from the laser to what stands at each of the `angles` [rad] from forward.

        As REP 117 wants it: -inf below `nearest`, inf beyond `farthest` [m].
        """
        yaw = self.pose()[2]
        origin = self.data.xpos[self._body] + self.data.xmat[self._body].reshape(3, 3)[:, 2] * laser_height(self.wheels)
        directions = np.column_stack([np.cos(angles + yaw), np.sin(angles + yaw), np.zeros(len(angles))])
        distances, geoms = np.empty(len(angles)), np.empty(len(angles), np.int32)
        groups = (np.arange(6) == WORLD_GROUP).astype(np.uint8)
        normals = {"normal": None} if "normal:" in mujoco.mj_multiRay.__doc__ else {}  # newer MuJoCo asks for them
        mujoco.mj_multiRay(self.mujoco_model, self.data, origin, directions.ravel(), groups, 1, self._body,
                           geoms, distances, nray=len(angles), cutoff=farthest, **normals)
        return np.select([(geoms < 0) | (distances > farthest), distances < nearest], [math.inf, -math.inf], distances)

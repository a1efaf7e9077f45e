"""The physics: body, wheels, motors, encoders and a laser scanner, moved on period by period."""

import math

import mujoco
import numpy as np

from robotont_description.geometry import laser_height
from robotont_simulator.imu import GRAVITY, ImuErrors
from robotont_simulator.mujoco_model import AWAY, FRICTION, TIMESTEP, VOLTAGE, WORLD_GROUP, build
from robotont_simulator.scenery import HEIGHT

GOOD, UNPLUGGED, REVERSED = 1, 0, -1  # states of an encoder
JAMMED = 50.0      # [N m] friction of a wheel that something holds: more than any motor
PUSH_DURATION = 0.3  # [s] that a push takes
PUSH_LIFT = 1.0      # part of the robot's weight that a push takes off its wheels, as a person carrying the robot would


class Simulation:
    """A robot with `Wheels` in a `World`. Deterministic for a seed and a sequence of calls.

    imu_rate: [Hz] of an inertial measurement unit, at most; as many whole steps of the physics as divide the period
    lie between two readings. 0: none.
    """

    def __init__(self, wheels, world, seed=0, imu_rate=0.0):
        self.wheels = wheels
        self.world = world
        self.random = np.random.default_rng(seed)
        self.mujoco_model = mujoco.MjModel.from_xml_string(build(wheels, world))
        self.data = mujoco.MjData(self.mujoco_model)
        self.voltage = VOLTAGE
        self._steps = max(1, round(1.0 / wheels.pid_frequency / TIMESTEP))
        self.mujoco_model.opt.timestep = 1.0 / wheels.pid_frequency / self._steps
        self._body = self.mujoco_model.body("base_link").id
        self._angle_at = [int(self.mujoco_model.joint(f"wheel{wheel}").qposadr[0]) for wheel in range(wheels.amount)]
        self._brake = self.mujoco_model.actuator_biasprm[:, 2].copy()
        self._rollers = [
            [geom for geom in range(self.mujoco_model.ngeom)
             if (self.mujoco_model.geom(geom).name or "").startswith(f"roller{wheel}_")]
            for wheel in range(wheels.amount)
        ]
        # encoders start anywhere
        self._counters = self.random.integers(0, 0x10000, wheels.amount)
        self._edges = np.zeros(wheels.amount, int)  # since the start, as the wheels turned
        self._encoders = np.full(wheels.amount, GOOD)
        self._powered = np.ones(wheels.amount, bool)
        self._dofs = [int(self.mujoco_model.joint(f"wheel{wheel}").dofadr[0]) for wheel in range(wheels.amount)]
        self._frictions = self.mujoco_model.dof_frictionloss[self._dofs].copy()
        self._efforts = np.zeros(wheels.amount)
        self._push_ends = 0.0  # [s]
        readings = max((part for part in range(1, self._steps + 1)
                        if self._steps % part == 0 and part * wheels.pid_frequency <= imu_rate), default=0)
        self._imu_steps = self._steps // readings if readings else 0
        self.imu_interval = self._imu_steps * self.mujoco_model.opt.timestep  # [s] between two readings
        self.imu_errors = ImuErrors(1 / self.imu_interval, np.random.default_rng([seed, 1])) if readings else None
        self.imu_readings = []  # of the newest period, oldest first, as `ImuErrors.measure` returns them
        mujoco.mj_forward(self.mujoco_model, self.data)

    @property
    def time(self):
        """[s] simulated since the start."""
        return self.data.time

    @property
    def inertia(self):
        """Mass [kg] and moment of inertia [kg m^2], about its middle, of the robot with its wheels."""
        turn, momentum = np.zeros(self.mujoco_model.nv), np.zeros(self.mujoco_model.nv)
        turn[5] = 1.0
        mujoco.mj_mulM(self.mujoco_model, self.data, momentum, turn)
        return float(self.mujoco_model.body_subtreemass[self._body]), float(momentum[5])

    def drive(self, wheel, effort):
        """Put `effort` (-1..1 of the battery's voltage) on a motor; 0 lets it coast."""
        self._efforts[wheel] = effort

    def step(self):
        """One PID period."""
        self.data.ctrl[:] = self._efforts * self._powered * (self.voltage / VOLTAGE)
        self.mujoco_model.actuator_biasprm[:, 2] = self._brake * self._driven()
        if self.time >= self._push_ends:
            self.data.xfrc_applied[self._body] = 0.0
        if self.imu_errors is None:
            mujoco.mj_step(self.mujoco_model, self.data, self._steps)
        else:
            self.imu_readings = [self._read_imu() for _ in range(self._steps // self._imu_steps)]
        edges = np.floor(self.wheel_angles() * self.wheels.edges_per_turn / (2 * math.pi)).astype(int)
        self._counters = (self._counters + self._encoders * (edges - self._edges)) % 0x10000
        self._edges = edges

    def _read_imu(self):
        """Move on to the next reading of the inertial measurement unit: means since the one before, in base_link."""
        data = self.data
        orientation, velocity = data.qpos[3:7].copy(), data.qvel[:3].copy()
        mujoco.mj_step(self.mujoco_model, data, self._imu_steps)
        rotation, matrix = np.empty(3), np.empty(9)
        mujoco.mju_subQuat(rotation, data.qpos[3:7], orientation)
        mujoco.mju_quat2Mat(matrix, data.qpos[3:7])
        acceleration = (data.qvel[:3] - velocity) / self.imu_interval + (0.0, 0.0, GRAVITY)
        return self.imu_errors.measure(rotation / self.imu_interval, matrix.reshape(3, 3).T @ acceleration)

    def counts(self):
        """Encoder counters, n, 0..65535."""
        return self._counters

    def wheel_angles(self):
        """[rad] that each wheel has turned."""
        return self.data.qpos[self._angle_at]

    def pose(self):
        """Ground truth of base_link: (x [m], y [m], yaw [rad])."""
        x, y, _, w, i, j, k = self.data.qpos[:7].tolist()
        return x, y, math.atan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k))

    def twist(self):
        """Ground truth in base_link: (v_x [m/s], v_y [m/s], omega [rad/s])."""
        yaw = self.pose()[2]
        vx, vy = self.data.qvel[:2]
        return (float(math.cos(yaw) * vx + math.sin(yaw) * vy), float(-math.sin(yaw) * vx + math.cos(yaw) * vy),
                float(self.data.qvel[5]))

    def push(self, x, y, turn=0.0):
        """An impulse on the body in world axes: (x, y) [N s] and [N m s], during PUSH_DURATION.

        It takes most of the weight off the wheels meanwhile, so that they slide and do not turn: the truth
        moves, the odometry does not see it.
        """
        weight = self.mujoco_model.body_subtreemass[self._body] * GRAVITY
        self.data.xfrc_applied[self._body] = (
            x / PUSH_DURATION, y / PUSH_DURATION, PUSH_LIFT * weight, 0, 0, turn / PUSH_DURATION)
        self._push_ends = self.time + PUSH_DURATION

    def carry(self, x, y, yaw):
        """Put the robot down at a pose [m, m, rad], at rest; the wheels have not turned."""
        data = self.data
        data.qpos[:2] = x, y
        data.qpos[3:7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)
        data.qvel[:6] = 0.0

    def visit(self, x, y):
        """Let the visitor, a cylinder, stand at (x, y) [m]; not finite: nowhere."""
        there = math.isfinite(x) and math.isfinite(y)
        self.data.mocap_pos[0] = (x, y, HEIGHT / 2) if there else AWAY

    def put_other(self, number, x, y):
        """Another robot stands at (x, y) [m]; number: 0 to `World.others` - 1."""
        self.data.mocap_pos[1 + number] = x, y, 0.0

    def set_grip(self, wheel, part):
        """Make a wheel slippery: `part` (0..1) of the normal friction."""
        self.mujoco_model.geom_friction[self._rollers[wheel], 0] = max(FRICTION * part, 1e-3)

    def set_mass(self, mass):
        """Make the body, without the wheels, this heavy [kg], of the same shape."""
        model = self.mujoco_model
        model.body_inertia[self._body] *= mass / model.body_mass[self._body]
        model.body_mass[self._body] = mass
        mujoco.mj_setConst(model, self.data)

    def set_encoder(self, wheel, state):
        """Make an encoder GOOD, UNPLUGGED or REVERSED."""
        self._encoders[wheel] = state

    def set_motor(self, wheel, powered):
        """Connect or disconnect a motor's current: without it the wheel rolls."""
        self._powered[wheel] = powered

    def set_jam(self, wheel, jammed):
        """Hold a wheel fast, or let it go."""
        self.mujoco_model.dof_frictionloss[self._dofs[wheel]] = JAMMED if jammed else self._frictions[wheel]

    def wheel_speeds(self):
        """[rad/s] of each wheel, n."""
        return self.data.qvel[self._dofs]

    def _driven(self):
        """Of each motor whether it has current: the driver leaves others open, which neither turns nor brakes."""
        return (self._efforts != 0) & self._powered

    def touches(self):
        """Whether the body touches a wall or a box."""
        body = self.mujoco_model.geom("body").id
        contacts = self.data.contact.geom[:self.data.ncon]
        return bool(len(contacts) and np.any(contacts == body))

    def scan(self, angles, nearest, farthest):
        """[m] from the laser to what stands at each of the `angles` [rad] from forward.

        As REP 117 wants it: -inf below `nearest`, inf beyond `farthest` [m].
        """
        yaw = self.pose()[2]
        matrix = self.data.xmat[self._body].reshape(3, 3)
        origin = self.data.xpos[self._body] + matrix[:, 2] * laser_height(self.wheels)
        directions = np.column_stack([np.cos(angles + yaw), np.sin(angles + yaw), np.zeros(len(angles))])
        distances = np.empty(len(angles))
        geoms = np.empty(len(angles), np.int32)
        groups = np.zeros(6, np.uint8)
        groups[WORLD_GROUP] = 1
        normals = {"normal": None} if "normal:" in mujoco.mj_multiRay.__doc__ else {}  # newer MuJoCo asks for them
        mujoco.mj_multiRay(self.mujoco_model, self.data, origin, directions.ravel(), groups, 1, self._body,
                           geoms, distances, nray=len(angles), cutoff=farthest, **normals)
        seen = geoms >= 0
        distances[~seen | (distances > farthest)] = math.inf
        distances[seen & (distances < nearest)] = -math.inf
        return distances

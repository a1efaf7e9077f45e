"""The robot and its world as MuJoCo's XML (MJCF), made from the wheel parameters for any number of wheels."""

import math

import mujoco

from robotont_description.geometry import camera_place, laser_height, robot_radius
from robotont_driver.kinematics.wheel_params import WHEEL_MASS
from robotont_simulator.world import HEIGHT

TIMESTEP = 0.002       # [s]
BODY_HEIGHT = 0.16     # [m] from the lower plate's underside to the top of the computer
CLEARANCE = 0.02       # [m] of the lower plate above the floor
ROLLERS = 9            # per row, as on the 2.75 inch omni wheel
ROW_OFFSET = 0.006     # [m] of each of the two rows from the wheel's middle
ROLLER_PART = 0.2      # radius of a roller, in radii of the wheel
FRICTION = 0.9         # rubber on a floor
VISITOR_RADIUS = 0.15  # [m] of what stands for a person who comes and goes
AWAY = (0, 0, -10)     # [m] where the visitor is when not there
VOLTAGE = 12.0         # [V] at which the robot's motors are what its wheel parameters say
GEAR_FRICTION = 0.04   # part of the stall torque that the gearbox costs
LEAST_BODY = 0.1       # [kg] without wheels
SEEN_BY = 0.03         # [m] by which another robot is higher than its laser
WORLD_GROUP, BODY_GROUP, PAINT_GROUP = 0, 1, 2  # MuJoCo's own, which the laser sees, and two that it does not

# Elliptic cones and the stiffness ratio keep rollers from creeping sideways; contacts are stiff, for rollers pressed
# flat make the wheel smaller. The light is even and without reflections, so that colours look the same everywhere.
HEAD = f"""
<mujoco model="robotont">
  <compiler angle="radian"/>
  <option timestep="{TIMESTEP}" cone="elliptic" integrator="implicitfast" impratio="10"/>
  <visual>
    <headlight ambient="0.65 0.65 0.65" diffuse="0.35 0.35 0.35" specular="0 0 0"/>
    <quality shadowsize="0"/> <map znear="0.002" zfar="5"/>
  </visual>
  <asset><texture type="skybox" builtin="flat" rgb1="0.75 0.82 0.9" width="8" height="48"/></asset>
  <default>
    <default class="paint"><geom contype="0" conaffinity="0" group="{PAINT_GROUP}"/></default>
    <default class="body"><geom type="cylinder" contype="2" group="{BODY_GROUP}"/></default>
    <default class="roller">
      <joint axis="1 0 0" damping="2e-6" armature="1e-7"/>
      <geom type="ellipsoid" mass="0.004" friction="{FRICTION} 0.005 0.0001" solref="0.005 1" priority="1"
        contype="2" group="{BODY_GROUP}"/>
    </default>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" friction="{FRICTION} 0.005 0.0001" rgba="0.45 0.45 0.45 1"/>
"""


class Scene:
    """A robot with `Wheels` in a `World`, for MuJoCo; base_link stands on the floor below the centre.

    painted: with what cannot be touched, for the camera.
    """

    def __init__(self, wheels, world, painted=False):
        self.mujoco_model = mujoco.MjModel.from_xml_string(_build(wheels, world, painted))
        self.data = mujoco.MjData(self.mujoco_model)

    def move(self, pose):
        """Put the robot at (x [m], y [m], yaw [rad]); its height and speed stay."""
        x, y, yaw = pose
        self.data.qpos[:2] = x, y
        self.data.qpos[3:7] = math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)

    def put(self, number, x, y):
        """The visitor (0) or another robot (1 and more) stands at x, y [m]; not finite: nowhere."""
        self.data.mocap_pos[number] = (x, y, 0.0) if math.isfinite(x + y) else AWAY


def _build(wheels, world, painted):
    """MJCF. Its mocap bodies are the visitor, then `world.others` robots."""
    (x, y, yaw), (ahead, up) = world.start, camera_place(wheels)
    radius, mass = robot_radius(wheels), max(LEAST_BODY, wheels.mass - wheels.amount * WHEEL_MASS)
    stall = wheels.motor.stall_torque * wheels.gear
    speed = wheels.motor.no_load_speed / wheels.gear / (1 - GEAR_FRICTION)
    other = _mocap(radius, laser_height(wheels) + SEEN_BY, "0.2 0.3 0.5 1")
    return "\n".join([
        HEAD, *(_geom(shape) for shape in world.shapes if painted or shape.solid),
        _mocap(VISITOR_RADIUS, HEIGHT, "0.5 0.5 0.5 1"), *[other] * len(world.others),
        f"""<body name="base_link" pos="{x} {y} 0" euler="0 0 {yaw}"> <freejoint/>
        <geom name="body" class="body" size="{radius} {BODY_HEIGHT / 2}" pos="0 0 {CLEARANCE + BODY_HEIGHT / 2}"
          mass="{mass}"/>
        <camera name="camera" pos="{ahead} 0 {up}" xyaxes="0 -1 0 0 0 1"/>""",
        *(_wheel(wheels, number) for number in range(wheels.amount)),
        "</body> </worldbody> <actuator>",
        *(f"""<general joint="wheel{number}" ctrlrange="-2 2" gainprm="{stall}" biastype="affine"
          biasprm="0 0 {-stall / speed}"/>""" for number in range(wheels.amount)),
        "</actuator> </mujoco>"])


def _geom(shape):
    """A `Shape`; one that is painted is neither touched nor seen by the laser."""
    size = (shape.length / 2, *(() if shape.round else (shape.width / 2,)), shape.height / 2)
    return f"""<geom type="{"cylinder" if shape.round else "box"}" pos="{shape.x} {shape.y} {shape.z}"
      size="{" ".join(map(str, size))}" euler="0 0 {shape.yaw}" rgba="{" ".join(map(str, shape.colour))} 1"
      class="{"main" if shape.solid else "paint"}"/>"""


def _mocap(radius, height, colour):
    """A cylinder that is somewhere else."""
    return f"""<body mocap="true" pos="{" ".join(map(str, AWAY))}">
      <geom type="cylinder" size="{radius} {height / 2}" pos="0 0 {height / 2}" rgba="{colour}"/> </body>"""


def _wheel(wheels, number):
    """A hub with two rows of rollers. A positive joint speed drives the robot along the wheel's direction."""
    radius, direction, position = wheels.radii[number], wheels.directions[number], wheels.positions[number]
    distance, gear, motor = wheels.distances[number], wheels.gear, wheels.motor
    thick = ROLLER_PART * radius
    # an ellipsoid whose tip is as curved as the wheel: the wheel rolls without bumps
    row = f"""<replicate count="{ROLLERS}" euler="0 0 {2 * math.pi / ROLLERS}">
        <body pos="{radius - thick} 0 0" xyaxes="0 1 0 1 0 0">
          <joint class="roller"/> <geom class="roller" size="{math.sqrt(thick * radius)} {thick} {thick}"/>
        </body> </replicate>"""
    # z along its axis, x = direction, y = down, so z = x cross y = the direction turned by +90 degrees
    return f"""<body name="hub{number}" pos="{distance * math.cos(position)} {distance * math.sin(position)} {radius}"
        xyaxes="{math.cos(direction)} {math.sin(direction)} 0 0 0 -1">
      <joint name="wheel{number}" axis="0 0 1" frictionloss="{motor.stall_torque * gear * GEAR_FRICTION}"
        armature="{motor.rotor_inertia * gear ** 2}"/>
      <geom class="body" size="{0.55 * radius} {1.6 * ROW_OFFSET}" mass="0.12" contype="0" conaffinity="0"/>
      <frame pos="0 0 {-ROW_OFFSET}">{row}</frame>
      <frame pos="0 0 {ROW_OFFSET}" euler="0 0 {math.pi / ROLLERS}">{row}</frame>
    </body>"""

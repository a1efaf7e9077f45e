"""The robot and its world as MuJoCo's XML (MJCF), made from the wheel parameters for any number of wheels."""

import math
from xml.etree import ElementTree

from robotont_description.geometry import camera_place, laser_height, robot_radius
from robotont_driver.kinematics.wheel_params import WHEEL_MASS
from robotont_simulator.scenery import HEIGHT

TIMESTEP = 0.002       # [s]
BODY_HEIGHT = 0.16     # [m] from the lower plate's underside to the top of the computer
CLEARANCE = 0.02       # [m] of the lower plate above the floor
HUB_MASS = 0.12        # [kg]
ROLLER_MASS = 0.004    # [kg]
ROLLERS = 9            # per row, as on the 2.75 inch omni wheel
ROW_OFFSET = 0.006     # [m] of each of the two rows from the wheel's middle
ROLLER_PART = 0.2      # radius of a roller, in radii of the wheel
FRICTION = 0.9         # rubber on a floor
CONTACT = (0.005, 1.0)  # [s], damping ratio: stiff, for rollers pressed flat make the wheel smaller
ROLLER_DAMPING = 2e-6  # [N m s] in a roller's bearing
VISITOR_RADIUS = 0.15  # [m] of what stands for a person who comes and goes
AWAY = (0, 0, -10)     # [m] where the visitor is when not there

VOLTAGE = 12.0         # [V] at which the robot's motors are what its wheel parameters say
GEAR_FRICTION = 0.04   # part of the stall torque that the gearbox costs
LEAST_BODY = 0.1       # [kg] without wheels

SEEN_BY = 0.03         # [m] by which another robot is higher than its laser
OTHER_COLOUR = (0.2, 0.3, 0.5)
WORLD_GROUP, BODY_GROUP, PAINT_GROUP = 0, 1, 2  # the laser sees the world
WALL_COLOUR = (0.72, 0.72, 0.7)
FLOOR_COLOUR = (0.45, 0.45, 0.45)


def build(wheels, world, picture=None):
    """MJCF string for `Wheels` and a `World`. base_link stands on the floor below the centre.

    picture: (width, height [pixels], vertical field of view [degrees], samples per pixel) of the camera; without
    it the model has nothing that cannot be touched.
    """
    root = ElementTree.Element("mujoco", model="robotont")
    add(root, "compiler", angle="radian", autolimits="true")
    if picture:
        _add_light(root, picture)
    # elliptic cones and the stiffness ratio keep rollers from creeping sideways
    add(root, "option", timestep=TIMESTEP, cone="elliptic", integrator="implicitfast", impratio=10)
    scene = add(root, "worldbody")
    add(scene, "geom", name="floor", type="plane", size=(0, 0, 1), friction=(FRICTION, 0.005, 0.0001),
        contype=1, conaffinity=1, group=WORLD_GROUP, rgba=(*FLOOR_COLOUR, 1))
    for number, box in enumerate(world.boxes):
        add(scene, "geom", name=f"box{number}", type="box", size=(box.length / 2, box.width / 2, HEIGHT / 2),
            pos=(box.x, box.y, HEIGHT / 2), euler=(0, 0, box.yaw),
            contype=1, conaffinity=1, group=WORLD_GROUP, rgba=(*WALL_COLOUR, 1))
    for number, shape in enumerate(world.scenery):
        if picture or shape.solid:
            _add_shape(scene, f"{shape.kind}{number}", shape)
    visitor = add(scene, "body", name="visitor", mocap="true", pos=AWAY)
    add(visitor, "geom", type="cylinder", size=(VISITOR_RADIUS, HEIGHT / 2),
        contype=1, conaffinity=1, group=WORLD_GROUP)
    tall = (laser_height(wheels) + SEEN_BY) / 2
    for number in range(world.others):
        other = add(scene, "body", name=f"other{number}", mocap="true", pos=AWAY)
        add(other, "geom", type="cylinder", size=(robot_radius(wheels), tall), pos=(0, 0, tall),
            contype=1, conaffinity=1, group=WORLD_GROUP, rgba=(*OTHER_COLOUR, 1))
    body = _add_robot(scene, wheels, world.start)
    if picture:
        x, z = camera_place(wheels)
        add(body, "camera", name="camera", pos=(x, 0, z), xyaxes=(0, -1, 0, 0, 0, 1), fovy=picture[2])
    actuators, motor = add(root, "actuator"), wheels.motor
    for number in range(wheels.amount):
        stall, speed = motor.stall_torque * wheels.gear, motor.no_load_speed / wheels.gear / (1 - GEAR_FRICTION)
        add(actuators, "general", name=f"motor{number}", joint=f"wheel{number}", ctrlrange=(-2, 2),
            gainprm=(stall,), biastype="affine", biasprm=(0, 0, -stall / speed))
    return ElementTree.tostring(root, encoding="unicode")


def _add_robot(scene, wheels, start):
    x, y, yaw = start
    radius = robot_radius(wheels)
    body = add(scene, "body", name="base_link", pos=(x, y, 0), euler=(0, 0, yaw))
    add(body, "freejoint", name="base")
    add(body, "geom", name="body", type="cylinder", size=(radius, BODY_HEIGHT / 2),
        pos=(0, 0, CLEARANCE + BODY_HEIGHT / 2),
        mass=max(LEAST_BODY, wheels.mass - wheels.amount * WHEEL_MASS), contype=2, conaffinity=1, group=BODY_GROUP)
    for number in range(wheels.amount):
        _add_wheel(body, wheels, number)
    return body


def _add_shape(scene, name, shape):
    """A `Shape` of the scenery; one that is painted is neither touched nor seen by the laser."""
    solid, halves = int(shape.solid), (shape.length / 2, shape.width / 2, shape.height / 2)
    add(scene, "geom", name=name, type="cylinder" if shape.round else "box",
        size=(halves[0], halves[2]) if shape.round else halves, pos=(shape.x, shape.y, shape.z),
        euler=(0, 0, shape.yaw), contype=solid, conaffinity=solid, rgba=(*shape.colour, 1),
        group=WORLD_GROUP if solid else PAINT_GROUP)


def _add_light(root, picture):
    """Even light without reflections, so that colours look the same everywhere, and a pale sky."""
    visual = add(root, "visual")
    add(visual, "global", offwidth=picture[0], offheight=picture[1])
    add(visual, "headlight", ambient=(0.65,) * 3, diffuse=(0.35,) * 3, specular=(0, 0, 0))
    add(visual, "quality", offsamples=picture[3], shadowsize=0)
    add(visual, "map", znear=0.002, zfar=5)
    sky = add(root, "asset")
    add(sky, "texture", type="skybox", builtin="flat", rgb1=(0.75, 0.82, 0.9), width=8, height=48)


def _add_wheel(body, wheels, number):
    """A hub with two rows of rollers. A positive joint speed drives the robot along the wheel's direction."""
    radius, direction, position = wheels.radii[number], wheels.directions[number], wheels.positions[number]
    distance = wheels.distances[number]
    # the wheel's frame: z along its axis, which is the driving direction turned by +90 degrees; y up
    hub = add(body, "body", name=f"hub{number}",
              pos=(distance * math.cos(position), distance * math.sin(position), radius),
              xyaxes=(math.cos(direction), math.sin(direction), 0, 0, 0, -1))
    # x = direction, y = down, so z = x cross y = the direction turned by +90 degrees
    add(hub, "joint", name=f"wheel{number}", type="hinge", axis=(0, 0, 1),
        frictionloss=wheels.motor.stall_torque * wheels.gear * GEAR_FRICTION,
        armature=wheels.motor.rotor_inertia * wheels.gear ** 2)
    add(hub, "geom", type="cylinder", size=(0.55 * radius, ROW_OFFSET * 1.6), mass=HUB_MASS,
        contype=0, conaffinity=0, group=BODY_GROUP)
    thick = ROLLER_PART * radius
    # an ellipsoid whose tip is as curved as the wheel: the wheel rolls without bumps
    long = math.sqrt(thick * radius)
    for row, offset in ((0, -ROW_OFFSET), (1, ROW_OFFSET)):
        for index in range(ROLLERS):
            angle = 2 * math.pi * (index + row / 2) / ROLLERS
            cos, sin = math.cos(angle), math.sin(angle)
            roller = add(hub, "body", pos=((radius - thick) * cos, (radius - thick) * sin, offset),
                         xyaxes=(-sin, cos, 0, cos, sin, 0))
            add(roller, "joint", type="hinge", axis=(1, 0, 0), damping=ROLLER_DAMPING, armature=1e-7)
            add(roller, "geom", name=f"roller{number}_{row}_{index}", type="ellipsoid", size=(long, thick, thick),
                mass=ROLLER_MASS, friction=(FRICTION, 0.005, 0.0001), solref=CONTACT, priority=1, contype=2,
                conaffinity=1, condim=3, group=BODY_GROUP)


def add(parent, tag, **attributes):
    """A child element; numbers and sequences become strings."""
    return ElementTree.SubElement(parent, tag, {name: text(value) for name, value in attributes.items()})


def text(value):
    """MJCF's way to write a value."""
    if isinstance(value, str):
        return value
    if isinstance(value, (tuple, list)):
        return " ".join(text(item) for item in value)
    return str(value)

"""What the tests of this folder share."""

import math
from pathlib import Path

import numpy as np
from lockstep import LockstepRun

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World, read_world
from robotont_testing.robots import SHIPPED

EMPTY = World()
ROOT = Path(__file__).resolve().parents[2]


def evenly(amount):
    """Parameters of a robot with this many wheels, evenly placed, in the shipped robot's size."""
    return {**SHIPPED, "wheelAmount": amount, "wheelRads": [2 * math.pi * i / amount + 0.3 for i in range(amount)],
            "wheelDistanceFromCenter": 0.15}


ROBOTS = {3: SHIPPED, 4: evenly(4), 5: evenly(5)}


def run_in(world="empty", wheels=3, seed=1, **parameters):
    """A fresh robot in a world, at rest; `parameters` of its wheels that differ."""
    simulation = Simulation(read_wheels({**ROBOTS[wheels], **parameters}),
                            read_world(ROOT / "config" / "worlds" / f"{world}.yaml"), seed)
    run = LockstepRun(simulation)
    run.hold((0.0, 0.0, 0.0), 0.4)
    return run


def tilt(run, slope, towards):
    """Let the floor fall by `slope` in the direction `towards` [degrees]."""
    slope, towards = math.radians(slope), math.radians(towards)
    down = math.sin(slope) * math.cos(towards), math.sin(slope) * math.sin(towards), -math.cos(slope)
    run.simulation.mujoco_model.opt.gravity[:] = 9.81 * np.array(down)

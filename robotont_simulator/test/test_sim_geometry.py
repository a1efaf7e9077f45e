import math
import subprocess
import sys
import types

import pytest
from robot_runs import EMPTY, ROOT

from robotont_description.geometry import robot_radius
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.robots.robot_folder import read_robot
from robotont_firmware import config, pin_profile, pin_profile_four
from robotont_firmware.robot_numbers import Numbers
from robotont_simulator.simulated_board import configuration
from robotont_simulator.simulation import Simulation
from robotont_testing.robots import ROBOTS, robot_folder


@pytest.mark.parametrize("name", ROBOTS)
def test_the_simulated_body_is_as_large_as_the_model_and_the_footprint(name, tmp_path):
    wheels = read_wheels(ROBOTS[name])
    model = Simulation(wheels, EMPTY).mujoco_model
    assert model.geom("body").size[0] == pytest.approx(robot_radius(wheels))
    robot = robot_folder(tmp_path, ROBOTS[name])
    script = ROOT / "robotont_description" / "scripts" / "robot_radius"  # navigation.launch makes the footprint with it
    printed = subprocess.run([sys.executable, str(script), f"robot:={robot}"], check=True, stdout=subprocess.PIPE)
    assert float(printed.stdout) == robot_radius(wheels)


@pytest.mark.parametrize("gear", [9.0, 18.75, 50.0])
def test_the_motors_have_the_gearbox_of_the_wheel_file(gear):
    """Lifted off the floor, a wheel turns as fast as the motor without load behind that gearbox."""
    wheels = read_wheels({**ROBOTS["shipped"], "gearboxReductionRatio": gear})
    simulation = Simulation(wheels, EMPTY)
    simulation.mujoco_model.opt.gravity[:] = 0.0
    simulation.data.qpos[2] += 0.2
    simulation.efforts[:] = 1.0
    for _ in range(150):
        simulation.step()
    turns = [simulation.data.joint(f"wheel{wheel}").qvel[0] / (2 * math.pi) for wheel in range(3)]
    assert turns == pytest.approx([156.25 / gear] * 3, rel=0.03)


@pytest.mark.parametrize("name, profile", [("thesis", pin_profile), ("four_wheels", pin_profile_four)])
def test_the_simulated_robot_has_the_numbers_of_the_firmware(name, profile):
    wheels = read_robot(name).wheels
    told = Numbers(configuration(wheels, *Simulation(wheels, EMPTY).inertia))
    flashed = Numbers(types.SimpleNamespace(**{**vars(config), **vars(profile)}))
    for number in ("lead", "turn_lead", "gain", "p", "i", "change", "braking", "brake", "arc", "stiffness", "shift"):
        assert getattr(told, number) == pytest.approx(getattr(flashed, number), rel=0.02), number


@pytest.mark.parametrize("key, value", [("encoderEdgesPerMotorRevolution", 8192), ("pidControlFrequency", 12.5)])
def test_a_robot_that_the_firmware_cannot_drive_is_refused_with_words(key, value):
    wheels = read_wheels({**ROBOTS["shipped"], "pidControlFrequency": 10, key: value})
    with pytest.raises(ValueError, match="cannot drive this robot: config.*found.*allowed"):
        configuration(wheels, 3.6, 0.043)

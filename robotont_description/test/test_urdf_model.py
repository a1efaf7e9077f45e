"""The URDF, read back: its wheels against the driver's kinematics, its shapes, its masses."""

import math
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robotont_description.geometry import camera_place, laser_height, robot_radius, upper_plate_radius
from robotont_description.urdf_model import main, urdf
from robotont_driver.kinematics.kinematics import wheel_matrix
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.robots import ROBOTS, robot_folder

SOLIDS = ["body_link", "pc_link", "battery_link", "camera_link", "main_board_link"]
PER_WHEEL = ["wheel_{}_link", "motor_{}_link", "motor_board_{}_link"]
FRAMES = ["base_link", "base_footprint", "camera_optical_frame", "laser"]
ROOT = Path(__file__).resolve().parents[2]
RIMS = ("rim_back", "rim_right", "rim_left")
GAZEBO = {"base_link", *(f"{rim}_link" for rim in RIMS), *(  # robotont_gazebo_basic of robotont_gazebo, a6e41b8
    f"roller_{row}_{number}_{rim}_link" for rim in RIMS for row in ("front", "back") for number in range(7))}


def numbers(text):
    return np.array([float(word) for word in text.split()])


def transform(origin):
    """4 x 4 matrix of an <origin>; roll, pitch, yaw about fixed axes, as URDF says."""
    matrix = np.eye(4)
    if origin is not None:
        turn = Rotation.from_euler("xyz", numbers(origin.get("rpy", "0 0 0")))
        matrix[:3, :3] = turn.apply(np.eye(3)).T
        matrix[:3, 3] = numbers(origin.get("xyz", "0 0 0"))
    return matrix


class Model:
    """A URDF, with the pose of every link in its root when all joints are at zero."""

    def __init__(self, text, root="base_link"):
        document = ElementTree.fromstring(text)
        self.links = {link.get("name"): link for link in document.iter("link")}
        self.joints = {joint.get("name"): joint for joint in document.findall("joint")}
        self.poses = {root: np.eye(4)}
        waiting = list(self.joints.values())
        while waiting:
            joint = next(joint for joint in waiting if joint.find("parent").get("link") in self.poses)
            waiting.remove(joint)
            parent = self.poses[joint.find("parent").get("link")]
            self.poses[joint.find("child").get("link")] = parent @ transform(joint.find("origin"))


@pytest.fixture(scope="module", params=ROBOTS.values(), ids=list(ROBOTS))
def parameters(request):
    return request.param


@pytest.fixture(scope="module")
def text(parameters, tmp_path_factory):
    return urdf(robot_folder(tmp_path_factory.mktemp("robot"), parameters))


@pytest.fixture(scope="module")
def model(text):
    return Model(text)


def rolling_matrix(model, amount):
    """n x 3 wheel matrix from the model alone.

    A wheel that turns positively about its axle a pushes its centre along a x z. Row i: by how much
    v_x, v_y and omega move the point above the contact along that direction.
    """
    rows = []
    for wheel in range(amount):
        joint = model.joints[f"wheel_{wheel}_joint"]
        assert joint.get("type") == "continuous"
        pose = model.poses[f"wheel_{wheel}_link"]
        axle = pose[:3, :3] @ numbers(joint.find("axis").get("xyz"))
        assert axle[2] == pytest.approx(0.0, abs=1e-12)
        assert np.linalg.norm(axle) == pytest.approx(1.0)
        direction = np.cross(axle, (0, 0, 1))
        turning = np.cross((0, 0, 1), pose[:3, 3])  # velocity of the point per omega
        rows.append((direction[0], direction[1], direction @ turning))
    return np.array(rows)


def cylinder(model, wheel):
    return model.links[f"wheel_{wheel}_link"].find("collision/geometry/cylinder")


def test_the_model_rolls_as_the_kinematics_say(model, parameters):
    wheels = read_wheels(parameters)
    np.testing.assert_allclose(rolling_matrix(model, wheels.amount), wheel_matrix(wheels), rtol=0, atol=1e-6)


def test_wheels_laser_and_camera_are_where_the_parameters_say(model, parameters):
    wheels = read_wheels(parameters)
    x, z = camera_place(wheels)
    places = {"laser": (0.0, 0.0, laser_height(wheels)), "camera_link": (x, 0.0, z)}  # where the simulator has them
    for wheel, (angle, distance, radius) in enumerate(zip(wheels.positions, wheels.distances, wheels.radii)):
        places[f"wheel_{wheel}_link"] = distance * math.cos(angle), distance * math.sin(angle), radius
        assert float(cylinder(model, wheel).get("radius")) == radius
    for link, place in places.items():
        np.testing.assert_allclose(model.poses[link][:3, 3], place, rtol=0, atol=1e-9)
    camera, optical = model.poses["camera_link"], model.poses["camera_optical_frame"]
    assert camera[0, 3] > 0.1
    np.testing.assert_allclose(camera[:3, 0], (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(optical[:3, :3], [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=1e-12)


def test_the_geometry_is_that_of_the_model(model, parameters):
    """What simulator and navigation take for the robot's size is what is drawn."""
    wheels = read_wheels(parameters)
    plates = [float(plate.get("radius")) for plate in model.links["body_link"].findall("collision/geometry/cylinder")]
    widest = max(float(cylinder(model, wheel).get("length")) for wheel in range(wheels.amount))
    lower = max(0.05, min(wheels.distances) - widest / 2 - 0.006)  # [m] between the wheels, 6 mm off them
    assert plates == pytest.approx([lower, upper_plate_radius(wheels)], abs=1e-9)
    ends = [np.array([along * float(cylinder(model, wheel).get("length")) / 2, across * radius, 0, 1])
            for wheel, radius in enumerate(wheels.radii) for along in (-1, 1) for across in (-1, 1)]
    corners = [np.hypot(*(model.poses[f"wheel_{number // 4}_link"] @ end)[:2]) for number, end in enumerate(ends)]
    farthest = max(*plates, *corners)
    assert farthest <= robot_radius(wheels) < farthest + 0.01


def test_every_part_is_there_with_a_shape_a_collision_and_a_mass(model, parameters):
    solids = {*SOLIDS, *(part.format(wheel) for part in PER_WHEEL for wheel in range(parameters["wheelAmount"]))}
    assert set(model.links) == solids | set(FRAMES)
    for name, link in model.links.items():  # a root with a mass would make robot_state_publisher complain
        assert {part.tag for part in link} == ({"visual", "collision", "inertial"} if name in solids else set()), name


def lowest(model, tag):
    """[m] lowest point of all shapes of a kind, with the name of its link."""
    found = []
    for name, link in model.links.items():
        for shape in link.findall(tag):
            pose = model.poses[name] @ transform(shape.find("origin"))
            box, cylinder = shape.find("geometry/box"), shape.find("geometry/cylinder")
            if box is not None:
                reach = np.abs(pose[2, :3]) @ numbers(box.get("size")) / 2
            else:
                reach = abs(pose[2, 2]) * float(cylinder.get("length")) / 2 \
                    + math.hypot(pose[2, 0], pose[2, 1]) * float(cylinder.get("radius"))
            found.append((pose[2, 3] - reach, name))
    return min(found)


@pytest.mark.parametrize("tag", ["visual", "collision"])
def test_nothing_is_below_the_floor_and_only_wheels_touch_it(model, tag):
    height, name = lowest(model, tag)
    assert height == pytest.approx(0.0, abs=0.001)
    assert height > -1e-9
    assert name.startswith("wheel")


def test_masses_and_inertias_are_possible(model, parameters):
    total, moment = 0.0, np.zeros(3)
    for name, link in model.links.items():
        if link.find("inertial") is None:
            continue
        mass = float(link.find("inertial/mass").get("value"))
        inertia = link.find("inertial/inertia")
        main = sorted(float(inertia.get(key)) for key in ("ixx", "iyy", "izz"))
        assert mass > 0, name
        assert main[0] > 0, name
        assert main[2] < main[0] + main[1], name  # else some mass would be negative
        total += mass
        moment += mass * (model.poses[name] @ transform(link.find("inertial/origin")))[:3, 3]
    assert 1.5 < total < 4.0
    centre = moment / total
    assert math.hypot(centre[0], centre[1]) < 0.03
    assert 0.0 < centre[2] < 0.1


def test_check_urdf_is_content(text, tmp_path):
    file = tmp_path / "robot.urdf"
    file.write_text(text)
    result = subprocess.run(["check_urdf", str(file)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            text=True, check=False)
    assert result.returncode == 0, result.stdout
    assert "Successfully Parsed" in result.stdout
    assert not any(word in result.stdout.lower() for word in ("error", "warn")), result.stdout


def test_a_prefix_is_put_before_every_link_and_joint():
    plain, other = Model(urdf()), Model(urdf(prefix="robot1/"), "robot1/base_link")
    assert set(other.links) == set(other.poses) == {"robot1/" + name for name in plain.links}  # joints lead to all
    assert set(other.joints) == {"robot1/" + name for name in plain.joints}


def test_without_xacro_it_says_where_there_is_one(monkeypatch):
    monkeypatch.setitem(sys.modules, "xacro", None)
    monkeypatch.setattr(sys, "argv", ["describe"])
    with pytest.raises(SystemExit, match="xacro.*: ./robotont setup sim .*description:=false"):
        main()


def test_xacro_alone_gives_the_same_model(tmp_path):
    """The file needs nothing but xacro: no script, no package path; defaults lead to config/."""
    file = ROOT / "robotont_description" / "urdf" / "robotont.urdf.xacro"
    code = f"import xacro; print(xacro.process_file({str(file)!r}, mappings={{}}).toxml())"
    text = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True,
                          check=True, cwd=str(tmp_path)).stdout
    assert Model(text).poses.keys() == Model(urdf()).poses.keys()


@pytest.mark.parametrize("rollers, found", [("true", 46), ("false", 4)])
def test_what_robotont_gazebo_refers_to_is_there(rollers, found):
    """In the model that it includes: base_link bears the rims, and with rollers all is found."""
    file = ROOT / "robotont_description" / "urdf" / "robotont_base.urdf.xacro"
    code = f"import xacro; print(xacro.process_file({str(file)!r}, mappings={{'rollers': {rollers!r}}}).toxml())"
    text = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True).stdout
    model = Model(text, root="base_footprint")
    assert len(GAZEBO) == 46
    assert len(GAZEBO & set(model.links)) == found
    assert set(model.poses) == set(model.links)  # joints lead to all
    for rim in RIMS:
        joint = model.joints[f"{rim}_joint"]
        assert (joint.get("type"), joint.find("parent").get("link")) == ("continuous", "base_link")
        np.testing.assert_allclose(np.linalg.norm(model.poses[f"{rim}_link"][:2, 3]), 0.145, atol=0.002)
    masses = [float(link.find("inertial/mass").get("value")) for link in model.links.values()
              if link.find("inertial")]
    assert sum(masses) == pytest.approx(3.03, abs=0.05)  # [kg] the official model's
    assert lowest(model, "visual")[0] == pytest.approx(0.0, abs=0.001)

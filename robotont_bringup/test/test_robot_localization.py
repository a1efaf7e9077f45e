"""config/robot_localization.yaml and its launch file against what the filter reads; the filter need not be there."""

import re
from pathlib import Path
from xml.etree import ElementTree

import yaml

from robotont_testing import places

DATA = Path(__file__).resolve().parent / "data"
KNOWN = yaml.safe_load((DATA / "robot_localization_parameters.yaml").read_text())
CONFIG = places.config("robot_localization.yaml")
GIVEN = yaml.safe_load(CONFIG.read_text())["ekf_odom"]


def is_known(name):
    """Whether the filter reads a parameter of that name."""
    match = re.fullmatch(r"(odom|imu)\d+(_\w+)?", name)
    return (match.group(2) or "") in KNOWN[match.group(1)] if match else name in KNOWN["filter"]


def test_every_parameter_is_one_that_the_filter_reads():
    file = ElementTree.parse(str(places.launch("robot_localization.launch")))
    node = file.find(".//node[@type='ekf_localization_node']")
    assert node.get("name") in yaml.safe_load(CONFIG.read_text())
    given = [*GIVEN, *(param.get("name") for param in node.iter("param"))]
    assert [name for name in given if not is_known(name)] == []


def test_the_process_noise_is_a_covariance():
    noise = GIVEN["process_noise_covariance"]
    rows = [noise[15 * row:15 * row + 15] for row in range(15)]
    assert len(noise) == 15 * 15
    assert all(isinstance(value, (int, float)) for value in noise)  # 1e-4 without a point would be a string
    assert all((value > 0) if row == column else value == 0
               for row, values in enumerate(rows) for column, value in enumerate(values))

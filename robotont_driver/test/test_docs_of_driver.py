"""What the pages of docs/ name exists, and their example is valid."""

import re
from pathlib import Path

import pytest
import yaml

from robotont_driver.kinematics import kinematics
from robotont_driver.kinematics import least_squares as solvers
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import KEYS, read_wheels
from robotont_testing.robots import SHIPPED

ROOT = Path(__file__).resolve().parents[2]


def test_the_example_of_another_robot_is_a_whole_file():
    page = (ROOT / "docs" / "robots.md").read_text()
    example = page.partition("`wheel_params.yaml`, all of it:")[2].partition("The wheels")[0]
    given = yaml.safe_load("\n".join(line[4:] for line in example.splitlines()))
    assert tuple(given) == KEYS
    assert read_wheels(given).amount == 4


OBJECTS = {"Kinematics": Kinematics(read_wheels(SHIPPED)), "kinematics": kinematics, "solvers": solvers}
THESIS_TABLE = (ROOT / "docs" / "thesis.md").read_text()


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`([^`]+)`", THESIS_TABLE))))
def test_what_the_thesis_table_names_exists(name):
    """A file or folder of the repository, an attribute of the driver's code, or a test in a test file."""
    if name.startswith("test_") and "." not in name:
        tests = "\n".join(path.read_text() for path in ROOT.glob("robotont_*/test/*.py"))
        assert f"def {name}(" in tests
    elif re.search(r"/|\.(py|yaml|launch|md)$", name):
        folders = [ROOT / name] if "/" in name else list(ROOT.glob(f"robotont_*/**/{name}"))
        assert any(path.exists() for path in folders)
    else:
        owner, _, attribute = name.rpartition(".")
        assert hasattr(OBJECTS[owner or "solvers"], attribute)

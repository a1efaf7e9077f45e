import re

import pytest

from conftest import HERE
from robotont_driver.driver_node import PARAMETERS as DRIVER
from robotont_driver.odom_node import PARAMETERS as ODOM
from robotont_driver.parameters import markdown_rows
from robotont_driver.serial_com_node import PARAMETERS as SERIAL_COM
from robotont_driver.wheels import KEYS

ROOT = HERE.parents[1]
README = (ROOT / "README.md").read_text()


@pytest.mark.parametrize("row", [row for table in (DRIVER, SERIAL_COM, ODOM) for row in markdown_rows(table)])
def test_every_parameter_stands_in_the_readme_as_it_is_in_the_code(row):
    assert row in README


@pytest.mark.parametrize("key", KEYS)
def test_every_wheel_parameter_stands_in_the_readme(key):
    assert f"| `{key}` |" in README


def test_what_the_thesis_table_names_exists():
    table = README.partition("## From the thesis to the code")[2].partition("## Licence")[0]
    sources = "\n".join(path.read_text() for path in ROOT.glob("robotont_*/**/*.py"))
    files = {path.name for folder in ROOT.glob("[a-z]*") if folder.is_dir() for path in folder.rglob("*")}
    for name in re.findall(r"`([^`]+)`", table):
        last = re.split(r"[/.]", name)[-1]
        is_file = name.rpartition("/")[2] in files
        assert is_file or f"def {last}(" in sources or f"self.{last} = " in sources, name

"""The folders of robotont_teleop have one direction: mux and web know hand, nobody else knows anybody."""

import re
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "robotont_teleop"


@pytest.mark.parametrize("room, allowed", [("hand", {"hand"}), ("mux", {"hand", "mux"}), ("web", {"hand", "web"})])
def test_a_room_imports_only_from_rooms_below(room, allowed):
    files = list((SOURCE / room).glob("*.py"))
    assert files
    assert {name for file in files for name in re.findall(r"from robotont_teleop\.(\w+)", file.read_text())} <= allowed

"""The stand-in boards of robotont_boards against what the makers' own firmware has answered to the same bytes."""

import json

import pytest

from robotont_boards import BOARDS
from robotont_testing import places
from robotont_testing.dc_motors import Motors
from robotont_testing.makers_firmware import CompiledBoard, library

GOLDEN = json.loads(places.data("golden_official_boards.json").read_text())
SECONDS = 2.0
ROUNDED = 5e-6  # single precision, six decimals


def answers(board, sends):
    """Lines of the board's feedback, as numbers, to [(s, text)]."""
    said = b""
    for at, text in sends:
        said += board.advance(at)
        board.receive(text.encode("latin-1"), at)
    said += board.advance(SECONDS)
    assert not getattr(board, "dead", "")
    return [[float(field) for field in line.split(b":")[1:]] for line in said.splitlines() if line.startswith(b"ODOM:")]


def golden():
    """(protocol, commit, sequence) of each golden one."""
    for board in GOLDEN["boards"]:
        for name, sends in GOLDEN["sequences"].items():
            lines = board["lines"].get(name)
            if lines:
                yield pytest.param(board["protocol"], board["commit"], sends, lines, id=f"{board['protocol']}, {name}")


@pytest.mark.parametrize("protocol, commit, sends, lines", golden())
def test_a_stand_in_answers_as_the_makers_firmware_does(protocol, commit, sends, lines):
    said = answers(BOARDS[protocol](Motors()), sends)
    for number, line in lines.items():
        assert said[int(number)] == pytest.approx(line, abs=ROUNDED), number
    path, missing = library(commit)
    if not missing:
        real = answers(CompiledBoard(path, Motors()), sends)
        for number, (one, other) in enumerate(zip(said, real)):
            assert one == pytest.approx(other, abs=ROUNDED), number
        assert abs(len(said) - len(real)) <= 1

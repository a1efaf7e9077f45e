"""The stand-in boards of robotont_boards against what the makers' own firmware has answered to the same bytes."""

import json

import pytest

from robotont_boards import BOARDS
from robotont_testing import places
from robotont_testing.dc_motors import Motors

GOLDEN = json.loads(places.data("golden_robotont3.json").read_text())


@pytest.mark.parametrize("sequence", GOLDEN["sequences"], ids=lambda sequence: sequence["name"])
def test_generation_3_answers_as_the_makers_firmware_does(sequence):
    """To the rounding of single precision."""
    board, said, sends = BOARDS["robotont3"](Motors()), b"", list(sequence["sends"])
    for millisecond in range(1, 2001):
        now = millisecond / 1000
        while sends and sends[0][0] <= now:
            board.receive(sends.pop(0)[1].encode(), now)
        said += board.advance(now)
    lines = [[float(field) for field in line.split(b":")[1:]] for line in said.splitlines() if line.startswith(b"ODOM")]
    for number, line in sequence["lines"].items():
        assert lines[int(number)] == pytest.approx(line, abs=5e-6), number

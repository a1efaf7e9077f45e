import csv
import math
import re
import sys

import pytest
import yaml
from robot_runs import ROOT, SHIPPED

from robotont_simulator.fast_drive import main

WHEELS = str(ROOT / "config" / "wheel_params.yaml")
FOUR = str(ROOT / "robotont_testing" / "data" / "four_wheels.yaml")
ROOM = str(ROOT / "config" / "worlds" / "room.yaml")


def figures(text):
    """(forward [mm], left [mm], turn [degrees]) of each line that fast_drive prints."""
    return [tuple(map(float, re.findall(r"([+-][0-9.]+)(?: mm|°)", line))) for line in text.splitlines()]


def test_umbmark_reports_an_odometry_that_is_good_and_not_perfect(capsys):
    assert main(["square=0.5", "square_clockwise=0.5", "--wheel-params", WHEELS]) == 0
    text = capsys.readouterr().out
    print(text)
    there, back = figures(text)
    for forward, left, turn in (there, back):
        assert 1.0 < math.hypot(forward, left) < 100.0
        assert abs(turn) < 2.0
    assert there[2] * back[2] < 0  # the wheels' own error turns with the robot


def test_wrong_parameters_and_slippery_wheels_show(capsys, tmp_path):
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text(yaml.safe_dump({**SHIPPED, "wheelRadius": SHIPPED["wheelRadius"] * 1.02}))
    assert main(["sideways=1", "--wheel-params", WHEELS]) == 0
    assert main(["sideways=1", "--wheel-params", WHEELS, "--believed", str(wrong)]) == 0
    assert main(["sideways=1", "--wheel-params", WHEELS, "--grip", "1=0.02"]) == 0
    right, wrong, slippery = (max(abs(forward), abs(left)) for forward, left, _ in figures(capsys.readouterr().out))
    assert right < 5.0
    assert wrong == pytest.approx(20.0, abs=5.0)
    assert slippery > 10 * right


def test_packets_and_truth_are_written(tmp_path):
    assert main(["spin=-0.5", "spin=0.1", "--wheel-params", WHEELS, "--csv", str(tmp_path)]) == 0
    assert sorted(file.name for file in tmp_path.iterdir()) == ["spin.csv", "spin_2.csv"]  # none over another
    with open(tmp_path / "spin.csv") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["time", "m0", "m1", "m2", "x", "y", "yaw"]
    begin, end = ([float(field) for field in row] for row in (rows[1], rows[-1]))
    assert begin[4:] == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)
    assert abs(math.remainder(end[6] - math.pi, 2 * math.pi)) < 0.05
    edges = sum(float(row[1]) for row in rows[1:])
    assert edges == pytest.approx(math.pi * 0.125 / SHIPPED["wheelRadius"] / (2 * math.pi) * 1200, rel=0.02)


@pytest.mark.parametrize("arguments, words", [
    (["circle"], "found drive 'circle', allowed: square, square_clockwise, spin, sideways"),
    (["square=-1"], "found 'square=-1', allowed: square=NUMBER, its side [m], > 0"),
    (["spin=often"], "found 'often', allowed: spin=NUMBER, its turns"),
    (["--grip", "0=2"], "found '0=2', allowed: WHEEL=PART"),
    (["--grip", "3=0.5"], "found --grip of wheel 3, allowed: 0 to 2"),
    (["--seed", "-1"], "expected non-negative integer"),
    (["--believed", ROOM], "room.yaml: wheelAmount: found 'nothing'"),
    (["--believed", FOUR], "found 4 wheels, allowed: 3, as in"),
])
def test_bad_input(arguments, words, capsys):
    with pytest.raises(SystemExit) as stop:
        sys.exit(main([*arguments, "--wheel-params", WHEELS]))
    assert stop.value.code in (1, 2)
    assert words in capsys.readouterr().err

import math
import re
import tarfile
from pathlib import Path

import numpy as np
import pytest
import yaml
from synthetic_runs import TAPE, TRACKED, drives, recorded, true_of, write_run

from robotont_calibration.calibrate_wheels import main
from robotont_driver.kinematics import se2
from robotont_testing.robots import SHIPPED, WHEEL_PARAMS
from robotont_testing.simulated_wheels import PERIOD

OPTIODOM = Path(__file__).parent / "data" / "optiodom"  # an excerpt: drives of a real robot
TRUE = true_of(SHIPPED, 1.02, 0.97, [(1, 1.5)])


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """(RUN arguments with a tape's ends, files with a ground truth) of a robot that differs from the parameters."""
    folder = tmp_path_factory.mktemp("runs")
    taped, tracked = [], []
    for number, twists in drives().items():
        counts, poses = recorded(TRUE, twists, number, TAPE)
        write(folder / f"taped_{number}.bag", counts)
        x, y, yaw = poses[-1]
        taped.append(f"{folder}/taped_{number}.bag={x:.3f},{y:.3f},{math.degrees(se2.wrap(yaw)):.1f}")
        tracked.append(folder / f"tracked_{number}.bag")
        write(tracked[-1], *recorded(TRUE, twists, number, TRACKED))
    return taped, tracked


def write(file, counts, poses=(), times=None):
    """A recording of a robot that begins at 1000 s; times: [s] of each packet, and of each pose."""
    times = 1000.0 + (PERIOD * np.arange(1, len(counts) + 1) if times is None else times)
    write_run(file, serial_read=zip(times, counts), truth=zip(times, poses))


def calibrated(folder, *arguments, wheel_params=WHEEL_PARAMS):
    """Exit status and the new parameters."""
    output = folder / "new.yaml"
    truth = [] if any("=" in str(word) for word in arguments) else ["--truth", "truth"]
    status = main(["--wheel-params", str(wheel_params), "-o", str(output), *truth, *map(str, arguments)])
    return status, yaml.safe_load(output.read_text()) if output.exists() else None


def test_with_a_ground_truth(runs, tmp_path, capsys):
    """No file is overwritten unasked; the table has each number in one unit, changes and deviations in their own."""
    (tmp_path / "new.yaml").write_text("mine: 1\n")
    assert calibrated(tmp_path, *runs[1]) == (1, {"mine": 1})
    assert "new.yaml: exists; --force overwrites it" in capsys.readouterr().err
    status, found = calibrated(tmp_path, *runs[1], "--force")
    assert status == 0
    assert found["wheelRadius"] == pytest.approx(TRUE["wheelRadius"], rel=0.002)
    assert found["wheelDistanceFromCenter"] == pytest.approx(TRUE["wheelDistanceFromCenter"], rel=0.002)
    assert found["wheelRads"] == pytest.approx(TRUE["wheelRads"], abs=math.radians(0.1))
    assert {key: found[key] for key in found if key not in (
        "wheelRadius", "wheelDistanceFromCenter", "wheelRads", "measuredPoint")}.items() <= SHIPPED.items()
    output, error = capsys.readouterr()
    rows = {row[:24].strip(): re.sub(r"[-+]?\d+\.\d+", "#", row[24:]).split() for row in output.splitlines()}
    assert rows["wheelRadius"] == rows["wheelDistanceFromCenter"] == ["m", "#", "#", "#%", "#%"]
    assert rows["wheelRads[2]"] == ["rad", "#", "#", "#°", "#°"]
    assert rows["point x"] == ["m", "#", "#", "#", "mm", "#", "mm"]
    assert "tracked 5" in output
    assert error == ""


def test_a_gap_in_the_stamps_is_named(tmp_path, capsys):
    (counts, poses), file = recorded(TRUE, drives()[2], 0, TRACKED), tmp_path / "gap.bag"
    times = PERIOD * np.arange(len(counts))
    write(file, counts, poses, times + 3600.0 * (times > times[-1] / 2))
    assert calibrated(tmp_path, file) == (1, None)
    assert f"{file}: found a gap of 3600.0" in capsys.readouterr().err


def test_with_a_tape_only_what_is_asked_for_changes(runs, tmp_path):
    """A motor's inertia of 1.2e-8 was written as 0."""
    (tmp_path / "runs.txt").write_text("\n".join([*runs[0], "--angles", "fixed"]))
    given = {**SHIPPED, "motorRotorInertia": 1.2e-8}
    (tmp_path / "given.yaml").write_text(yaml.safe_dump(given))
    status, found = calibrated(tmp_path, f"@{tmp_path / 'runs.txt'}", wheel_params=tmp_path / "given.yaml")
    assert status == 0
    assert found["wheelRadius"] == pytest.approx(TRUE["wheelRadius"], rel=0.005)
    assert {key for key in given if found[key] != given[key]} == {"wheelRadius", "wheelDistanceFromCenter"}


def test_a_run_that_determines_nothing_and_has_a_gap_is_named_and_not_written(runs, tmp_path, capsys):
    counts, _ = recorded(TRUE, drives()[2], 2, TAPE)
    left = np.delete(np.arange(len(counts)), np.s_[99:111])
    write(tmp_path / "spin.bag", counts[left], (), PERIOD * left)
    assert calibrated(tmp_path, f"{tmp_path / 'spin.bag'}={runs[0][2].partition('=')[2]}") == (4, None)
    output, error = capsys.readouterr()
    assert "NOT DETERMINED" in output
    assert "spin: 12 packets are missing or came too late, the longest gap is 0.26 s" in output
    assert "warning: these runs do not determine wheelRadius" in error
    assert error.endswith("nothing is written; use none of these values\n")


@pytest.mark.parametrize("arguments, words", [
    ([], "one of the arguments RUN --guide is required"),
    (["--guide", "a", "b.bag"], "argument RUN: not allowed with argument --guide"),
    (["nowhere.bag"], "nowhere.bag: no such file"),
    (["{0}=1,2"], "found '1,2', allowed: X,Y,YAW of the end"),
    (["{0}=1e300,0,0"], "found '1e300,0,0', allowed: X,Y,YAW of the end"),
    (["{0}=1,2,north"], "found '1,2,north'"),
    (["{0}"], "found no topic truth; there are: serial_read"),
    (["{1}/four.bag=0,0,0"], "found a packet of 4 wheels, allowed: 3"),
    (["{0}=0,0,0", "--wheel-params", "{1}/bad.yaml"], "bad.yaml: wheelAmount: found 2"),
    (["--guide", "a", "--side", "-1"], "found '-1', allowed: a number > 0, at most 1e6"),
])
def test_bad_input(arguments, words, runs, tmp_path, capsys):
    write(tmp_path / "four.bag", [(1, 2, 3, 4)])
    (tmp_path / "bad.yaml").write_text("wheelAmount: 2\n")
    file = runs[0][0].partition("=")[0]
    with pytest.raises(SystemExit) as stop:
        raise SystemExit(calibrated(tmp_path, *(word.format(file, tmp_path) for word in arguments))[0])
    assert stop.value.code in (1, 2)
    assert words in capsys.readouterr().err
    assert not (tmp_path / "new.yaml").exists()


def test_a_real_robot(tmp_path, capsys):
    """The point is found, and the error falls; one radius is likelier."""
    with tarfile.open(str(OPTIODOM / "runs.tar.xz")) as archive:
        archive.extractall(str(tmp_path))
    for file in tmp_path.glob("*.csv"):
        table = np.loadtxt(str(file), delimiter=",", skiprows=1)
        write(file.with_suffix(".bag"), table[:, 1:4], table[:, 4:], table[:, 0])
    status, written = calibrated(tmp_path, *sorted(tmp_path.glob("*.bag")), wheel_params=OPTIODOM / "wheel_params.yaml")
    assert status == 0
    text = capsys.readouterr().out
    assert "are the same thing" in text
    x, y = (float(re.search(rf"point {axis} +m +[-\d.]+ +([-\d.]+)", text)[1]) for axis in "xy")
    assert (x, y) == (pytest.approx(-0.03, abs=0.008), pytest.approx(-0.031, abs=0.008))
    before, after = map(float, re.findall(r"([\d.]+) mm", re.search(r"^mean .*", text, re.M)[0]))
    print(f"optiodom, 8 drives: mean error of place {before:.0f} mm with its file, {after:.0f} mm calibrated on them")
    assert after < 0.5 * before
    assert isinstance(written["wheelRadius"], float)
    assert written["wheelRadius"] == pytest.approx(0.051 * 0.96, rel=0.02)
    assert written["measuredPoint"] == pytest.approx((x, y), abs=5e-5)

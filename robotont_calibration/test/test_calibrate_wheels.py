import math
import re
import unittest.mock
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from synthetic_runs import TAPE, TRACKED, drives, recorded, true_of

from robotont_calibration import calibration_guide
from robotont_calibration.calibrate_wheels import main
from robotont_calibration.cross_validation import HeldOut
from robotont_calibration.odometry_report import main as odometry_report
from robotont_calibration.recording_files import read_recording, write_csv
from robotont_testing.robots import SHIPPED, WHEEL_PARAMS
from robotont_testing.simulated_wheels import PERIOD

PARAMS = WHEEL_PARAMS
TRUE = true_of(SHIPPED, 1.02, 0.97, [(1, 1.5)])


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """(RUN arguments with a tape's ends, files with a ground truth) of a robot that differs from the parameters."""
    folder = tmp_path_factory.mktemp("runs")
    taped, tracked = [], []
    for number, twists in enumerate(drives()):
        for kind, deviation in (("taped", TAPE), ("tracked", TRACKED)):
            counts, poses = recorded(TRUE, twists, number, deviation)
            packets = [(PERIOD * index, tuple(packet)) for index, packet in enumerate(counts.tolist(), 1)]
            file = folder / f"{kind}_{number}.csv"
            if kind == "taped":
                write_csv(file, packets)
                x, y, yaw = poses[-1]
                taped.append(f"{file}={x:.3f},{y:.3f},{math.degrees(math.remainder(yaw, 2 * math.pi)):.1f}")
            else:
                write_csv(file, packets, [(at, tuple(pose)) for (at, _), pose in zip(packets, poses.tolist())])
                tracked.append(str(file))
    return taped, tracked


def calibrated(folder, *arguments):
    """Exit status and the new parameters."""
    output = folder / "new.yaml"
    status = main(["--wheel-params", str(PARAMS), "-o", str(output), "--picture", str(folder / "a.png"), *arguments])
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
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_gap_in_the_stamps_is_named(runs, tmp_path, capsys):
    file = tmp_path / "gap.csv"
    rows = Path(runs[1][0]).read_text().splitlines()
    shifted = [row.split(",", 1) for row in rows[len(rows) // 2:]]
    file.write_text("\n".join(rows[:len(rows) // 2] + [f"{float(time) + 3600:.6f},{rest}" for time, rest in shifted]))
    status, _ = calibrated(tmp_path, str(file))
    assert status == 1
    assert f"{file}: found a gap of 3600.02 s behind the packet at " in capsys.readouterr().err


def test_with_a_tape_and_arguments_from_a_file(runs, tmp_path):
    (tmp_path / "runs.txt").write_text("\n".join(runs[0]))
    status, found = calibrated(tmp_path, f"@{tmp_path / 'runs.txt'}")
    assert status == 0
    assert found["wheelRadius"] == pytest.approx(TRUE["wheelRadius"], rel=0.005)


def test_only_what_is_asked_for_changes(runs, tmp_path):
    _, found = calibrated(tmp_path, *runs[1], "--angles", "fixed")
    assert {key for key in SHIPPED if found[key] != SHIPPED[key]} == {"wheelRadius", "wheelDistanceFromCenter"}


def test_what_is_worse_than_the_old_file_is_not_written(runs, tmp_path, capsys):
    """Every other run is of a robot whose wheels have turned by 3 % more, or less, than by the old file."""
    files = []
    for number, file in enumerate(runs[1]):
        recording, part = read_recording(file, {}), 1.03 if number % 2 else 0.97
        files.append(str(tmp_path / Path(file).name))
        write_csv(files[-1], [(at, [part * count for count in counts]) for at, counts in recording.packets],
                  recording.truth)
    (tmp_path / "old.yaml").write_text(yaml.safe_dump(TRUE))
    assert calibrated(tmp_path, *files, "--wheel-params", str(tmp_path / "old.yaml")) == (4, None)
    assert re.search(r"runs that were held out end \d+ mm off, with the old file \d+ mm", capsys.readouterr().err)


@pytest.mark.parametrize("gains, better", [
    ((0.002, 0.0, 0.0, 0.0, -0.001, 0.001), False), ((0.004, 0.003, 0.005, 0.003, 0.004, 0.006), True),
    ((0.0001, 0.0001, 0.0001, 0.0001, 0.0001, 0.0002), False), ((0.002, 0.005), False)],
    ids=["by chance", "all runs", "too little", "two runs"])
def test_more_radii_are_taken_only_for_a_gain_that_is_no_chance(gains, better):
    common = HeldOut(np.full(len(gains), 0.01), np.zeros(len(gains)))
    assert HeldOut(common.places - gains, common.yaws).is_better_than(common) is better


def test_a_run_that_determines_nothing_and_has_a_gap_is_named_and_not_written(runs, tmp_path, capsys):
    file, _, end = runs[0][2].partition("=")
    rows = Path(file).read_text().splitlines()
    (tmp_path / "spin.csv").write_text("\n".join(rows[:100] + rows[112:]))
    assert calibrated(tmp_path, f"{tmp_path / 'spin.csv'}={end}") == (4, None)
    output, error = capsys.readouterr()
    assert "NOT DETERMINED" in output
    assert "spin: 12 packets are missing or came too late, the longest gap is 0.26 s" in output
    assert "warning: these runs do not determine wheelRadius" in error
    assert error.endswith("nothing is written; use none of these values\n")


@pytest.mark.parametrize("arguments, words", [
    ([], "found neither runs nor --guide"),
    (["--guide", "a", "b.csv"], "found --guide and recorded runs"),
    (["nowhere.csv"], "nowhere.csv: no such file"),
    (["{0}=1,2"], "found '1,2', allowed: X,Y,YAW of the end"),
    (["{0}=1,2,north"], "found '1,2,north'"),
    (["{0}"], "found no true pose"),
    (["{0}=1,2,3", "--point", "1"], "found '1', allowed: free, fixed or X,Y [m]"),
    (["{0}=1,2,3", "--format", "optiodom"], "found the line 'time,m0,m1,m2', allowed: 7 numbers"),
    (["--guide", "a", "--side", "-1"], "found '-1', allowed: a number > 0"),
])
def test_bad_input(arguments, words, runs, tmp_path, capsys):
    file = runs[0][0].partition("=")[0]
    with pytest.raises(SystemExit) as stop:
        raise SystemExit(calibrated(tmp_path, *(word.format(file) for word in arguments))[0])
    assert stop.value.code in (1, 2)
    assert words in capsys.readouterr().err
    assert not (tmp_path / "new.yaml").exists()


def test_packets_of_another_robot_and_parameters_that_are_none(runs, tmp_path, capsys):
    file = tmp_path / "four.csv"
    write_csv(file, [(0.0, (1, 2, 3, 4))])
    assert calibrated(tmp_path, f"{file}=0,0,0")[0] == 1
    assert "found a packet of 4 wheels, allowed: 3" in capsys.readouterr().err
    bad = tmp_path / "bad.yaml"
    bad.write_text("wheelAmount: 2\n")
    assert main(["--wheel-params", str(bad), *runs[1]]) == 1
    assert "bad.yaml: wheelAmount: found 2" in capsys.readouterr().err


def test_a_real_robot(tmp_path, capsys):
    """An excerpt of OptiOdom: the point is found, the error falls, and held-out runs are better, too."""
    folder = Path(__file__).parent / "data" / "optiodom"
    output = tmp_path / "new.yaml"
    assert main(["--wheel-params", str(folder / "wheel_params.yaml"), "-o", str(output), "--format", "optiodom",
                 "--picture", str(tmp_path / "a.png"), *map(str, sorted(folder.glob("*_?.csv")))]) == 0
    text = capsys.readouterr().out
    print(text)
    assert "are the same thing" in text
    x, y = (float(re.search(rf"point {axis} +m +[-\d.]+ +([-\d.]+)", text)[1]) for axis in "xy")
    assert (x, y) == (pytest.approx(-0.03, abs=0.008), pytest.approx(-0.031, abs=0.008))
    before, after, blind = (float(place) for place in re.findall(r"([\d.]+) mm", text[text.index("mean "):])[:3])
    assert after < 0.5 * before
    assert blind < 0.6 * before
    written = yaml.safe_load(output.read_text())
    assert written["wheelRadius"] == pytest.approx(0.051 * 0.96, rel=0.02)
    assert written["measuredPoint"] == pytest.approx((x, y), abs=5e-5)
    report = ["--wheel-params", str(output), "--format", "optiodom", "-o", str(tmp_path / "b.png")]
    places = []
    for point in ([], ["--point", "0,0"]):  # the file knows the point
        assert odometry_report([str(folder / "square_1.csv"), *report, *point]) == 0
        places.append(float(re.search(r"mean square +([\d.]+) mm", capsys.readouterr().out)[1]))
    assert places[0] < 0.7 * places[1]


def of_optiodom(folder, runs, *arguments):
    data = Path(__file__).parent / "data" / "optiodom"
    return main(["--wheel-params", str(data / "wheel_params.yaml"), "-o", str(folder / "new.yaml"), *arguments,
                 "--format", "optiodom", "--picture", str(folder / "a.png"), *map(str, sorted(data.glob(runs)))])


def test_one_kind_of_drives_is_warned_of_and_stated_to_be_less_certain(tmp_path, capsys):
    """Squares alone leave the distance 0.6 % off what circles and squares give."""
    assert of_optiodom(tmp_path, "square_?.csv") == 3
    output, error = capsys.readouterr()
    assert "the runs are of one kind" in error
    change, deviation = re.search(r"wheelDistanceFromCenter +m .* ([-+][\d.]+)% +([\d.]+)%", output).groups()
    assert abs(float(change) + 2.39) < 2 * float(deviation)
    assert (tmp_path / "new.yaml").exists()


def test_a_point_that_the_runs_contradict_is_refused(tmp_path, capsys):
    """The marker is 41 mm off the middle: a calibration would be worse than none."""
    assert of_optiodom(tmp_path, "*_?.csv", "--point", "fixed") == 4
    error = capsys.readouterr().err
    assert "by the runs the measured point is -0.0" in error
    assert "nothing is written" in error
    assert not (tmp_path / "new.yaml").exists()


def test_a_run_is_kept_when_its_user_quits_at_the_question(tmp_path, monkeypatch, capsys):
    robot = SimpleNamespace(_recording=SimpleNamespace(packets=[(0.0, (1, 2, 3)), (0.02, (1, 2, 3))]), _frequency=50,
                            _with_truth=False)
    monkeypatch.setattr("builtins.input", unittest.mock.Mock(side_effect=KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        calibration_guide._Robot.save(robot, tmp_path / "spin.csv")
    assert (tmp_path / "spin.csv").exists()
    assert f"RUN {tmp_path / 'spin.csv'}=X,Y,YAW" in capsys.readouterr().out

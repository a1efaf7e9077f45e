import math
import re

import numpy as np
import pytest
from synthetic_runs import write_run

from robotont_calibration import odometry_report
from robotont_calibration.odometry_report import report
from robotont_calibration.recordings import Recording
from robotont_calibration.trajectory import Trajectory, synchronise
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.robots import SHIPPED, WHEEL_PARAMS
from robotont_testing.simulated_wheels import PERIOD, counted, path_of, rolled, square, still, straight

WHEELS = read_wheels(SHIPPED)
START = 1000.0  # [s]


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A bag of a square, with noise that shows: truth at 40 Hz, odometry and packets at 50 Hz. No master."""
    path = tmp_path_factory.mktemp("bag") / "drive.bag"
    twists = np.concatenate([square(1.0, 1), straight(0.5, 0.7)])
    counts = counted(WHEELS, rolled(WHEELS, twists), 0.01, np.random.default_rng(1)).tolist()
    poses, times = path_of(twists), START + PERIOD * np.arange(len(twists) + 1)
    made = Recording()
    made.packets = list(zip(times[1:], counts))
    seen = np.arange(START, times[-1], 0.025)
    write_run(path, serial_read=made.packets, odom=zip(times[1:], made.recomputed(WHEELS).poses),
              truth=zip(seen, Trajectory(times, poses).at(seen)))
    return path


@pytest.mark.parametrize("arguments, packets", [
    ([], "[1-9]"), (["--wheel-params", str(WHEEL_PARAMS)], "[1-9]"), (["--packets", "x"], "none on x")])
def test_the_table_and_the_picture(arguments, packets, bag, tmp_path, capsys):
    picture = tmp_path / "report.png"
    assert odometry_report.main([str(bag), "--truth", "truth", "-o", str(picture), *arguments]) == 0
    output = capsys.readouterr().out
    for words in ("ground truth", "drift per metre", "packets and poses refused"):
        assert words in output
    assert re.search(f"^packets +{packets}", output, re.MULTILINE)
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("arguments, words", [
    ([], "found no ground truth, allowed: --truth TOPIC"),
    (["--odom", "nowhere"], "found no odometry on nowhere; with --wheel-params"),
    (["--truth", "elsewhere"], "found no topic elsewhere; there are: odom, serial_read, truth"),
])
def test_what_cannot_be_compared_ends_with_one_line(arguments, words, bag, capsys):
    assert odometry_report.main([str(bag), *arguments]) == 1
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_packets_that_came_late_leave_no_spikes():
    """Up to 30 ms late, in order: their arrivals taken for stamps made an error of 5 mm and more."""
    twists = np.concatenate([still(2.0), straight(3.0, 1.0), still(1.0)])
    times = PERIOD * np.arange(1, len(twists) + 1)
    arrivals = np.maximum.accumulate(times + np.random.default_rng(1).uniform(0.0, 0.03, len(times)))
    recording = Recording()
    recording.packets = list(zip(arrivals, map(tuple, counted(WHEELS, rolled(WHEELS, twists)).tolist())))
    truth = Trajectory(np.concatenate([[0.0], times]), path_of(twists))
    estimate, truth = synchronise(recording.recomputed(WHEELS), truth)
    assert 1000 * np.hypot(*(estimate.poses - truth.poses).T[:2]).max() < 1.0


def line(length, turn=0.0, number=101):
    times = np.linspace(0, 10, number)
    return Trajectory(times, np.column_stack([times / 10 * length, 0 * times, se2.wrap(times / 10 * turn)]))


@pytest.mark.parametrize("driven, true, figures", [
    ((10.1,), (10.0,), {
        "error at the end": "100.0 mm, 0.00°", "drift per metre": "10.0 mm", "drift per turn": "too few turns",
        "absolute error, largest": "100.0 mm",
        "absolute error, root mean square": "57.9 mm, 0.00°",  # some 100 mm by the root of 3
        "relative error per 1 m, root mean square": "10.0 mm, 0.00°"}),
    ((0.0, 4 * math.pi + 0.2), (0.0, 4 * math.pi), {
        "drift per turn": "5.73°", "ground truth": "10.0 s, 0.00 m, 2.00 turns, both ways added",
        "drift per metre": "no path",
        "relative error per 1 m, root mean square": "path shorter than two of 1 m"}),
], ids=["ahead", "on the spot"])
def test_known_errors_give_known_figures(driven, true, figures):
    assert figures.items() <= dict(report(line(*driven), line(*true))[0]).items()


def test_the_estimate_is_laid_on_the_start_of_the_reference():
    truth = Trajectory(np.arange(5.0), [(0, 0, 0), (1, 0, 0.1), (1, 1, 0.2), (2, 1, 0.3), (2, 2, 0.4)])
    moved = np.transpose(se2.compose((3, -1, -math.pi / 2), truth.poses.T))
    laid, _ = synchronise(Trajectory(truth.times, moved), truth)
    np.testing.assert_allclose(laid.poses, truth.poses, atol=1e-12)


def test_only_where_both_are_known_they_are_compared():
    known = line(1.0)
    estimate, reference = synchronise(known, Trajectory(known.times + 5, known.poses))
    assert (estimate.times[0], estimate.times[-1]) == (5.0, 10.0)
    assert np.array_equal(estimate.times, reference.times)
    with pytest.raises(ValueError, match="do not overlap in time"):
        synchronise(known, Trajectory(known.times + 50, known.poses))

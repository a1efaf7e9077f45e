import contextlib
import io
import math
import os
import sys

import numpy as np
import pytest
import rosbag
import rospy
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import Odometry
from std_msgs.msg import String, UInt8MultiArray

from robotont_calibration import odometry_report
from robotont_calibration.odometry_report import relative_errors, rows, sizes, timing
from robotont_calibration.recording_files import read_recording, write_csv
from robotont_calibration.recordings import Recording, RecordingError
from robotont_calibration.trajectory import Trajectory, synchronise
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.protocol import format_packet
from robotont_testing.robots import SHIPPED, WHEEL_PARAMS
from robotont_testing.simulated_wheels import PERIOD, counted, path_of, rolled, square, still, straight

WHEELS = read_wheels(SHIPPED)
START = 1000.0  # [s]


def pose_message(time, pose):
    message = Odometry()
    message.header.stamp = rospy.Time.from_sec(time)
    message.pose.pose.position.x, message.pose.pose.position.y = pose[:2]
    message.pose.pose.orientation.z, message.pose.pose.orientation.w = math.sin(pose[2] / 2), math.cos(pose[2] / 2)
    return message


@pytest.fixture(scope="module")
def drive():
    """Twists, poses and packets of a square, with noise that shows."""
    twists = np.concatenate([square(1.0, 1), straight(0.5, 0.7)])
    counts = counted(WHEELS, rolled(WHEELS, twists), 0.01, np.random.default_rng(1)).tolist()
    packets = [(START + PERIOD * index, tuple(packet)) for index, packet in enumerate(counts, 1)]
    return twists, path_of(twists), packets


@pytest.fixture(scope="module")
def bag(drive, tmp_path_factory):
    """A bag of that drive: truth at 40 Hz, odometry and packets at 50 Hz, commands at 50 Hz. No master."""
    twists, poses, packets = drive
    path = tmp_path_factory.mktemp("bag") / "drive.bag"
    made = Recording()
    made.packets = packets
    times = START + PERIOD * np.arange(len(poses))
    with rosbag.Bag(str(path), "w") as file:
        for (time, packet), pose in zip(packets, made.recomputed(Kinematics(WHEELS)).poses):
            file.write("/serial_read", String(format_packet(packet)), rospy.Time.from_sec(time))
            file.write("/odom", pose_message(time, pose), rospy.Time.from_sec(time))
        for time, (x, y, turn) in zip(times, twists):
            file.write("/cmd_vel", Twist(Vector3(x, y, 0), Vector3(0, 0, turn)), rospy.Time.from_sec(time))
        for time in np.arange(START, times[-1], 0.025):
            pose = [np.interp(time, times, column) for column in poses.T]
            file.write("/ground_truth/odom", pose_message(time, pose), rospy.Time.from_sec(time))
    return path


def evo(folder, relation, delta):
    """The root mean square that evo makes of the exported files."""
    os.environ["HOME"] = str(folder)  # where it writes its settings
    from evo import main_ape, main_rpe
    from evo.core import metrics, sync
    from evo.tools.file_interface import read_tum_trajectory_file

    both = sync.associate_trajectories(*(read_tum_trajectory_file(str(folder / f"{name}.tum"))
                                         for name in ("reference", "odometry")))
    relation = metrics.PoseRelation[relation]
    found = main_rpe.rpe(*both, relation, delta, metrics.Unit.meters, pairs_from_reference=True) if delta else \
        main_ape.ape(*both, relation)
    return found.stats["rmse"]


@pytest.fixture(scope="module")
def exported(bag, tmp_path_factory):
    """(folder with the exported files, what was printed), by the command line."""
    folder = tmp_path_factory.mktemp("tum")
    with contextlib.redirect_stdout(io.StringIO()) as output:
        assert odometry_report.main([str(bag), "--truth", "ground_truth/odom", "-o", str(folder / "report.png"),
                                     "--tum", str(folder), "--delta", "0.5"]) == 0
    return folder, output.getvalue()


def read_tum(path):
    time, x, y, *_, z, w = np.loadtxt(str(path)).T
    return Trajectory(time, np.column_stack([x, y, 2 * np.arctan2(z, w)]))


@pytest.mark.skipif(sys.version_info < (3, 10), reason="evo's relatives need a newer numpy than the system's")
@pytest.mark.parametrize("index, relation, delta", [
    (0, "translation_part", None), (1, "rotation_angle_rad", None),
    (0, "translation_part", 0.5), (1, "rotation_angle_rad", 0.5)])
def test_numbers_equal_those_of_evo(exported, index, relation, delta, monkeypatch):
    monkeypatch.setenv("HOME", os.environ["HOME"])  # as it is, behind the test
    estimate, reference = (read_tum(exported[0] / f"{name}.tum") for name in ("odometry", "reference"))
    errors = relative_errors(estimate, reference, delta) if delta else estimate.poses - reference.poses
    ours = np.sqrt(np.mean(sizes(errors)[index] ** 2))
    assert ours > 1e-4
    assert abs(ours - evo(exported[0], relation, delta)) < 1e-6


def test_the_table_and_the_picture(exported):
    folder, output = exported
    assert "path of the ground truth" in output
    assert "packets refused" in output
    assert (folder / "report.png").read_bytes().startswith(b"\x89PNG")


def test_without_a_truth_the_commanded_path_is_the_reference(bag, tmp_path, capsys):
    assert odometry_report.main([str(bag), "-o", str(tmp_path / "a.png")]) == 0
    assert "commanded path  " in capsys.readouterr().out


def test_csv_with_truth_and_parameters_of_ones_own(drive, tmp_path, capsys):
    _, poses, packets = drive
    path = tmp_path / "drive.csv"
    write_csv(path, packets, [(time, tuple(pose)) for (time, _), pose in zip(packets, poses[1:])])
    recording = read_recording(path, {})
    assert recording.packets == pytest.approx(packets)
    assert len(recording.truth) == len(packets)
    assert odometry_report.main([str(path), "--wheel-params", str(WHEEL_PARAMS), "-o", str(tmp_path / "a.png")]) == 0
    assert "drift per metre" in capsys.readouterr().out


@pytest.mark.parametrize("content, words", [
    ("", "found nothing"),
    ("a,b,c\n", "found the heading 'a,b,c', allowed: time,m0"),
    ("time,m0,m1,m2\n1,2,3,4\n1,2,3\n", "found the line '1,2,3', allowed: 4 numbers"),
    ("# words\ntime,m0,m1,m2\n1,2,3,4\n2,2,x,4\n", "found the line '2,2,x,4', allowed: 4 numbers"),
    ("time,m0,m1,m2\n1,2,3,nan\n", "found the line '1,2,3,nan', allowed: 4 numbers up to 1e"),
    ("time,m0,m1,m2\n1,2,3," + "4" * 200000 + "\n", "found the line '1,2,3,444"),
    (b"# f\xfcr\ntime,m0,m1,m2\n", "not UTF-8"),
], ids=lambda value: repr(value)[:30])
def test_a_csv_that_is_none_is_refused(tmp_path, content, words):
    path = tmp_path / "a.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(RecordingError, match=words) as raised:
        read_recording(path, {})
    assert len(str(raised.value)) < 600


@pytest.mark.parametrize("kind", ["packets", "commands", "odometry", "truth"])
def test_a_topic_with_other_messages_is_refused(tmp_path, kind):
    path = tmp_path / "other.bag"
    with rosbag.Bag(str(path), "w") as file:
        file.write("topic", UInt8MultiArray(), rospy.Time(1))
    with pytest.raises(RecordingError, match="topic: found std_msgs/UInt8MultiArray, allowed: "):
        read_recording(path, {kind: "topic"})


def test_malformed_packets_and_poses_in_a_bag_are_counted(tmp_path):
    path = tmp_path / "malformed.bag"
    packets = ["1:2:3;\n", "9" * 400 + ":0:0;\n", "9" * 10 ** 6, "1" * 310 + ".0:0:0;\n", "nan:0:0;\n",
               ":" * 10 ** 5, ""]
    with rosbag.Bag(str(path), "w") as file:
        for packet in packets:
            file.write("packets", String(packet), rospy.Time(1))
        file.write("odom", pose_message(1.0, (math.nan, 0.0, 0.0)), rospy.Time(1))
    recording = read_recording(path, {"packets": "packets", "odometry": "odom"})
    assert recording.packets == [(1.0, (1, 2, 3))]
    assert recording.odometry == []
    assert recording.refused == len(packets)


@pytest.mark.parametrize("name, content, words", [
    ("missing.bag", None, "no such file"),
    ("a.txt", "", "found a file of type '.txt', allowed: .bag, .csv"),
    ("a.bag", "no bag", "a.bag"),
    ("empty.bag", "", "empty.bag"),
])
def test_a_file_that_is_no_recording_ends_with_one_line(tmp_path, capsys, name, content, words):
    path = tmp_path / name
    if content is not None:
        path.write_text(content)
    assert odometry_report.main([str(path), "-o", str(tmp_path / "a.png")]) == 1
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_a_wrong_truth_topic_lists_those_that_there_are(bag, capsys):
    assert odometry_report.main([str(bag), "--truth", "truth"]) == 1
    words = "found no topic truth; there are: /cmd_vel, /ground_truth/odom, /odom, /serial_read"
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("stamped, least, most", [(False, 0.0, 1.0), (True, 5.0, 50.0)])
def test_packets_that_came_late_leave_no_spikes(stamped, least, most):
    """Up to 30 ms late, in order; stamped: their arrivals are taken for stamps. Largest error [mm]."""
    twists = np.concatenate([still(2.0), straight(3.0, 1.0), still(1.0)])
    times = PERIOD * np.arange(1, len(twists) + 1)
    arrivals = np.maximum.accumulate(times + np.random.default_rng(1).uniform(0.0, 0.03, len(times)))
    recording = Recording()
    recording.stamped = stamped
    recording.packets = list(zip(arrivals, map(tuple, counted(WHEELS, rolled(WHEELS, twists)).tolist())))
    truth = Trajectory(np.concatenate([[0.0], times]), path_of(twists))
    estimate, truth = synchronise(recording.recomputed(Kinematics(WHEELS)), truth)
    assert least < 1000 * sizes(estimate.poses - truth.poses)[0].max() < most


def line(length, turn=0.0, number=101):
    times = np.linspace(0, 10, number)
    return Trajectory(times, np.column_stack([times / 10 * length, 0 * times, times / 10 * turn]))


@pytest.mark.parametrize("driven, true, figures", [
    ((10.1,), (10.0,), {
        "error at the end": "100.0 mm, 0.00°", "drift per metre": "10.0 mm", "drift per turn": "too few turns",
        "absolute error, largest": "100.0 mm",
        "absolute error, root mean square": "57.9 mm, 0.00°",  # some 100 mm by the root of 3
        "relative error per 1 m, root mean square": "10.0 mm, 0.00°"}),
    ((0.0, 4 * math.pi + 0.2), (0.0, 4 * math.pi), {
        "drift per turn": "5.73°", "turned, to and fro": "2.00 turns", "drift per metre": "no path",
        "relative error per 1 m, root mean square": "path shorter than two of 1 m: --delta"}),
], ids=["ahead", "on the spot"])
def test_known_errors_give_known_figures(driven, true, figures):
    assert figures.items() <= dict(rows(line(*driven), line(*true))).items()


def test_the_estimate_is_laid_on_the_start_of_the_reference():
    truth = Trajectory(np.arange(5.0), [(0, 0, 0), (1, 0, 0.1), (1, 1, 0.2), (2, 1, 0.3), (2, 2, 0.4)])
    moved = np.transpose(se2.compose((3, -1, -math.pi / 2), truth.poses.T))
    laid, _ = synchronise(Trajectory(truth.times, moved), truth)
    np.testing.assert_allclose(laid.poses, truth.poses, atol=1e-12)


def commanded(*commands):
    recording = Recording()
    recording.commands = list(commands)
    return recording.commanded_path()


def test_commands_hold_until_the_next_one_or_half_a_second():
    path = commanded((1.0, (0.2, 0.0, 0.0)), (1.1, (0.0, 0.4, 0.0)), (3.0, (0.0, 0.0, 1.0)))
    np.testing.assert_allclose(path.at([1.0, 1.1, 1.35, 1.6, 2.9, 3.25, 3.5]).poses, [
        (0, 0, 0), (0.02, 0, 0), (0.02, 0.1, 0), (0.02, 0.2, 0), (0.02, 0.2, 0), (0.02, 0.2, 0.25), (0.02, 0.2, 0.5),
    ], atol=1e-9)
    leaping = commanded((10.0, (0.2, 0.0, 0.0)), (1.76e9, (0.2, 0.0, 0.0)))
    assert len(leaping.times) < 100, "a clock that leaps ends the command before it"
    np.testing.assert_allclose(leaping.poses[-1], (0.2, 0, 0), atol=1e-6)


def test_only_where_both_are_known_they_are_compared():
    known = line(1.0)
    estimate, reference = synchronise(known, Trajectory(known.times + 5, known.poses))
    assert (estimate.times[0], estimate.times[-1]) == (5.0, 10.0)
    assert np.array_equal(estimate.times, reference.times)
    with pytest.raises(ValueError, match="do not overlap in time"):
        synchronise(known, Trajectory(known.times + 50, known.poses))


def test_lost_messages_are_counted():
    words = timing(np.delete(np.arange(100) * 0.02, [10, 50, 51]))
    assert words == "97 at 48.5/s, 3 missing or late; 20.0 ms between two, at most 60 ms"


def test_numbers_tell_what_is_missing_and_lateness_does_not():
    times = np.arange(6) * 0.02
    times[3] += 0.03
    assert ", 0 missing; " in timing(times, [7, 8, 9, 10, 11, 12])
    assert ", 3 missing; " in timing(times, [7, 8, 10, 11, 14, 0])


@pytest.mark.parametrize("times, poses, words", [
    ([0.0], [(0, 0, 0)], "found 1 poses"),
    ([0.0, 0.0], [(0, 0, 0)] * 2, "found 1 poses at different times"),
    ([0.0, 1.0], [(0, 0, 0)], "found 2 times for 1 poses"),
    ([0.0, 1.0], [(0, 0, 0), (0, math.nan, 0)], "not a finite number"),
])
def test_what_is_no_trajectory_is_refused(times, poses, words):
    with pytest.raises(ValueError, match=words):
        Trajectory(times, poses)

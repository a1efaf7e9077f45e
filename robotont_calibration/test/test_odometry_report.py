import math
import sys

import numpy as np
import pytest
import rosbag
import rospy
from nav_msgs.msg import Odometry
from std_msgs.msg import String, UInt8MultiArray

from robotont_calibration import odometry_report
from robotont_calibration.odometry_report import relative_errors, rows, sizes
from robotont_calibration.recordings import Recording, RecordingError, read_recording
from robotont_calibration.trajectory import Trajectory, synchronise
from robotont_driver.kinematics import se2
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
    """Poses and packets of a square, with noise that shows."""
    twists = np.concatenate([square(1.0, 1), straight(0.5, 0.7)])
    counts = counted(WHEELS, rolled(WHEELS, twists), 0.01, np.random.default_rng(1)).tolist()
    packets = [(START + PERIOD * index, tuple(packet)) for index, packet in enumerate(counts, 1)]
    return path_of(twists), packets


@pytest.fixture(scope="module")
def bag(drive, tmp_path_factory):
    """A bag of that drive: truth at 40 Hz, odometry and packets at 50 Hz. No master."""
    poses, packets = drive
    path = tmp_path_factory.mktemp("bag") / "drive.bag"
    made = Recording()
    made.packets = packets
    times = START + PERIOD * np.arange(len(poses))
    with rosbag.Bag(str(path), "w") as file:
        for (time, packet), pose in zip(packets, made.recomputed(WHEELS).poses):
            file.write("/serial_read", String(format_packet(packet)), rospy.Time.from_sec(time))
            file.write("/odom", pose_message(time, pose), rospy.Time.from_sec(time))
        for time in np.arange(START, times[-1], 0.025):
            pose = [np.interp(time, times, column) for column in poses.T]
            file.write("/ground_truth/odom", pose_message(time, pose), rospy.Time.from_sec(time))
    return path


@pytest.fixture(scope="module")
def compared(bag):
    """(odometry, truth), as the command compares them."""
    recording = read_recording(bag, {"odometry": "odom", "truth": "ground_truth/odom"})
    return synchronise(recording.trajectory("odometry"), recording.trajectory("truth"))


@pytest.mark.skipif(sys.version_info < (3, 10), reason="evo's relatives need a newer numpy than the system's")
@pytest.mark.parametrize("index, relation, delta", [
    (0, "translation_part", None), (1, "rotation_angle_rad", None),
    (0, "translation_part", 0.5), (1, "rotation_angle_rad", 0.5)])
def test_numbers_equal_those_of_evo(compared, index, relation, delta, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))  # where it writes its settings
    from evo import main_ape, main_rpe
    from evo.core import metrics
    from evo.core.trajectory import PoseTrajectory3D
    estimate, reference = compared
    errors = relative_errors(estimate, reference, delta) if delta else estimate.poses - reference.poses
    theirs = []
    for one in (reference, estimate):
        x, y, yaw = one.poses.T
        zeros = 0 * x
        theirs.append(PoseTrajectory3D(np.column_stack([x, y, zeros]), np.column_stack([
            np.cos(yaw / 2), zeros, zeros, np.sin(yaw / 2)]), one.times))
    relation = metrics.PoseRelation[relation]
    found = main_rpe.rpe(*theirs, relation, delta, metrics.Unit.meters, pairs_from_reference=True) if delta else \
        main_ape.ape(*theirs, relation)
    assert found.stats["rmse"] > 1e-4
    assert np.sqrt(np.mean(sizes(errors)[index] ** 2)) == pytest.approx(found.stats["rmse"], abs=1e-6)


def test_the_table_and_the_picture_and_what_lacks_a_truth(bag, tmp_path, capsys):
    assert odometry_report.main([str(bag), "--truth", "ground_truth/odom", "-o", str(tmp_path / "report.png")]) == 0
    output = capsys.readouterr().out
    assert "path of the ground truth" in output
    assert "packets refused" in output
    assert (tmp_path / "report.png").read_bytes().startswith(b"\x89PNG")
    assert odometry_report.main([str(bag)]) == 1
    assert "found no ground truth, allowed: --truth TOPIC" in capsys.readouterr().err


def test_the_picture_of_the_demo(compared, tmp_path):
    odometry_report.draw(tmp_path / "demo.png", "demo", *compared, commanded=np.zeros((2, 2)), allowed=0.03)
    assert (tmp_path / "demo.png").read_bytes().startswith(b"\x89PNG")


def test_parameters_of_ones_own(bag, tmp_path, capsys):
    arguments = [str(bag), "--truth", "ground_truth/odom", "--wheel-params", str(WHEEL_PARAMS)]
    assert odometry_report.main([*arguments, "-o", str(tmp_path / "a.png")]) == 0
    assert "drift per metre" in capsys.readouterr().out


@pytest.mark.parametrize("kind", ["packets", "odometry", "truth"])
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
    words = "found no topic truth; there are: /ground_truth/odom, /odom, /serial_read"
    assert words in capsys.readouterr().err


def test_packets_that_came_late_leave_no_spikes():
    """Up to 30 ms late, in order: their arrivals taken for stamps made an error of 5 mm and more."""
    twists = np.concatenate([still(2.0), straight(3.0, 1.0), still(1.0)])
    times = PERIOD * np.arange(1, len(twists) + 1)
    arrivals = np.maximum.accumulate(times + np.random.default_rng(1).uniform(0.0, 0.03, len(times)))
    recording = Recording()
    recording.packets = list(zip(arrivals, map(tuple, counted(WHEELS, rolled(WHEELS, twists)).tolist())))
    truth = Trajectory(np.concatenate([[0.0], times]), path_of(twists))
    estimate, truth = synchronise(recording.recomputed(WHEELS), truth)
    assert 1000 * sizes(estimate.poses - truth.poses)[0].max() < 1.0


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


def test_only_where_both_are_known_they_are_compared():
    known = line(1.0)
    estimate, reference = synchronise(known, Trajectory(known.times + 5, known.poses))
    assert (estimate.times[0], estimate.times[-1]) == (5.0, 10.0)
    assert np.array_equal(estimate.times, reference.times)
    with pytest.raises(ValueError, match="do not overlap in time"):
        synchronise(known, Trajectory(known.times + 50, known.poses))


@pytest.mark.parametrize("times, poses, words", [
    ([0.0], [(0, 0, 0)], "found 1 poses"),
    ([0.0, 0.0], [(0, 0, 0)] * 2, "found 1 poses at different times"),
    ([0.0, 1.0], [(0, 0, 0)], "found 2 times for 1 poses"),
    ([0.0, 1.0], [(0, 0, 0), (0, math.nan, 0)], "not a finite number"),
])
def test_what_is_no_trajectory_is_refused(times, poses, words):
    with pytest.raises(ValueError, match=words):
        Trajectory(times, poses)

"""The guide in time of its own: with a user who answers, and a robot that only takes notes."""

import math
from collections import deque
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import String

from robotont_calibration import calibration_guide
from robotont_calibration.recordings import Recording, read_recording
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.robots import SHIPPED, UNEVEN_4

CTRL_C, ENTER_THEN_CTRL_C = "at the question", "in the run"


class Bench:
    """What the robot is told, by topic, and the guide's own time."""

    def __init__(self, folder):
        self.folder, self.now, self.interrupted = folder, 0.0, math.inf  # [s]
        self.told, self.heard_by, self.packet = {}, [], String("0:0:0;")
        self.answers, self.wheels = deque(), read_wheels(SHIPPED)

    def publisher(self, topic, *_, **__):
        speeds = self.told[topic] = []
        return Mock(publish=lambda twist: speeds.append((twist.linear.x, twist.linear.y, twist.angular.z)))

    def subscriber(self, topic, kind, callback, *given, **_):
        self.heard_by.append(lambda: callback(self.packet if kind is String else kind(), *given))

    def sleep(self, seconds):
        self.now += seconds
        if self.now > self.interrupted:
            self.interrupted = math.inf
            raise KeyboardInterrupt
        for hear in self.heard_by if self.packet else ():
            hear()

    def input(self, _question):
        answer = self.answers.popleft()
        if answer == CTRL_C:
            raise KeyboardInterrupt
        if answer == ENTER_THEN_CTRL_C:
            self.interrupted = self.now + 1.0
            return ""
        return answer

    def guide(self, *answers, packets="serial_read", truth=None):
        """(Names of the runs that were made, lines of the file of all runs)."""
        self.answers.extend(answers)
        options = SimpleNamespace(guide=str(self.folder), side=1.0, turns=1.0, line=1.0, packets=packets, truth=truth,
                                  wheel_params="mine.yaml")
        made = calibration_guide.guide(options, read_wheels(SHIPPED))
        return made, (self.folder / "runs.txt").read_text().splitlines()


@pytest.fixture
def bench(monkeypatch, tmp_path):
    bench = Bench(tmp_path)
    for name, stand_in in (("Publisher", bench.publisher), ("Subscriber", bench.subscriber),
                           ("get_time", lambda: 1000.0 + bench.now), ("get_param", lambda *_: "thesis"),
                           ("resolve_name", lambda name: name if name[0] == "/" else "/robot1/" + name)):
        monkeypatch.setattr(calibration_guide.rospy, name, stand_in)
    for name, stand_in in (("time", SimpleNamespace(monotonic=lambda: bench.now, sleep=bench.sleep)),
                           ("init_tool", lambda _: None), ("running_wheels", lambda _: bench.wheels),
                           ("get_topic_class", lambda name: (None if "nowhere" in name else PoseStamped, "", None))):
        monkeypatch.setattr(calibration_guide, name, stand_in)
    monkeypatch.setattr("builtins.input", bench.input)
    return bench


def test_ctrl_c_stops_a_run_which_does_not_count_and_ends_all_at_the_question(bench, capsys):
    made, lines = bench.guide("s", "s", "", ENTER_THEN_CTRL_C, CTRL_C, truth="truth")
    told = bench.told["/robot1/cmd_vel"]
    assert told[-2:] == [(0.0, 0.0, pytest.approx(-0.8, abs=0.01)), (0.0, 0.0, 0.0)]
    assert "Stopped by Ctrl-C. This run does not count" in capsys.readouterr().out
    assert lines == ["--packets=serial_read", "--truth=truth", *made]
    assert made == [f"{bench.folder}/spin.bag"]
    spin = read_recording(made[0], {"packets": "serial_read", "truth": "truth"})
    assert len(spin.packets) == len(spin.truth) > told.index((0.0, 0.0, 0.0)) > 300


def test_where_it_stands_is_asked_until_it_is_a_place_and_a_run_of_which_nobody_says_it_is_kept(bench, capsys):
    with pytest.raises(ValueError, match="found no run to calibrate with"):
        bench.guide("", "0 0 ninety", CTRL_C)
    said, kept = capsys.readouterr().out, bench.folder / "square.bag"
    assert "found '0 0 ninety', allowed: X,Y,YAW" in said
    assert f"RUN {kept}=X,Y,YAW" in said
    assert read_recording(kept, {"packets": "serial_read"}).packets
    assert bench.guide("", "0.03, -0.05 2", "q")[0] == [f"{bench.folder}/square_2.bag=0.03,-0.05,2"]


@pytest.mark.parametrize("packets, driven", [
    ("/robot2/serial_read", "/robot2/cmd_vel"), ("serial_read", "/robot1/cmd_vel"), ("/serial_read", "/cmd_vel")])
def test_the_robot_that_is_driven_is_the_one_whose_packets_are_recorded(bench, packets, driven):
    bench.guide("", "1 0 0", "q", packets=packets)
    assert list(bench.told) == [driven]


@pytest.mark.parametrize("changed, truth, words", [
    ({"packet": None}, None, "for packets on serial_read; is the robot running?"),
    ({}, "nowhere", "found no topic nowhere; is its node running?"),
    ({"folder": Path("/nowhere/a=b")}, None, "a=b, allowed: a folder without = in its name"),
    ({"wheels": read_wheels(UNEVEN_4)}, None,
     "mine.yaml: found other wheels .*--wheel-params .*thesis/wheel_params.yaml")])
def test_a_guide_that_cannot_begin_says_why_and_moves_nothing(bench, changed, truth, words):
    vars(bench).update(changed)
    with pytest.raises(ValueError, match=words):
        bench.guide("", "1 0 0", "q", truth=truth)
    assert not any(bench.told.values())


def test_a_second_session_in_a_folder_keeps_the_runs_of_the_first(bench, capsys):
    """As long as their files are there."""
    def runs(text):
        return [f"{bench.folder}/{run}=1,0,0" for run in text.split()]
    first = runs("square.bag square_clockwise.bag")
    assert bench.guide("", "1,0,0", "", "1,0,0", "q") == (first, ["--packets=serial_read", *first])
    before = (bench.folder / "square_clockwise.bag").read_bytes()
    second = runs("square_clockwise_2.bag spin.bag")
    assert bench.guide("s", "", "1,0,0", "", "1,0,0", "q") == (second, ["--packets=serial_read", *first, *second])
    assert (bench.folder / "square_clockwise.bag").read_bytes() == before
    (bench.folder / "square.bag").unlink()
    assert bench.guide("", "1,0,0", "q")[1][1:] == [first[1], *second, first[0]]
    assert f"@{bench.folder}/runs.txt" in capsys.readouterr().out


@pytest.mark.parametrize(("counts", "rests"), [
    ([0.0], True), ([1, -1], True), ([-1, 0, 1], True), ([0.1] * 9 + [-0.9], True),  # a wheel that hunts for its edge
    ([1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], False), ([2, -2], False), ([1, 1, -1], False)])
def test_a_robot_rests_when_no_wheel_gets_an_edge_away(counts, rests):
    robot = calibration_guide._Robot.__new__(calibration_guide._Robot)
    robot._recording = Recording()
    for number in range(40):
        robot._recording.packets.append((0.02 * number, (0, counts[number % len(counts)], 0)))
        assert not robot._rests() or number >= 24
    assert robot._rests() == rests

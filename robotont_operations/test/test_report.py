"""What is in a report, and what cannot be."""

import io
import re
import sys
import tarfile
from unittest.mock import Mock

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Twist
from rosgraph_msgs.msg import Log
from std_msgs.msg import String

from robotont_operations import report
from robotont_testing.harness import free_port
from robotont_testing.robots import SHIPPED

SECRET = "x7Rk hunter22 lmno"  # behind no word that means one


@pytest.fixture(name="run")
def _run(tmp_path, monkeypatch, capsys):
    """Run the report; (its words, {name: contents})."""
    monkeypatch.setattr(report, "COMMANDS", {})
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "logs"))
    monkeypatch.setenv("ROS_MASTER_URI", f"http://me:hunter22@127.0.0.1:{free_port()}")
    output = tmp_path / "r.tar.gz"
    monkeypatch.setattr(sys, "argv", ["report", "--output", str(output), "--black-box", str(tmp_path / "box")])

    def run():
        assert report.main() == 0
        assert output.stat().st_mode & 0o777 == 0o600
        with tarfile.open(str(output)) as archive:
            return capsys.readouterr().out, {member.name: archive.extractfile(member).read().decode("utf-8", "replace")
                                             for member in archive if member.isfile()}
    return run


def test_what_fails_or_of_which_nothing_may_be_kept_is_in_the_notes_and_a_small_archive_has_a_size(
        run, monkeypatch, tmp_path):
    monkeypatch.setattr(report, "COMMANDS", {
        "a.txt": (("echo", "fine"), ".*"), "b.txt": (("false",), ".*"), "c.txt": (("no_such",), ".*"),
        "d.txt": (("echo", SECRET), "tty.*")})
    said, found = run()
    notes = found["r/notes.txt"]
    for words in ("b.txt: false has ended with status 1", "c.txt: ", "d.txt: echo has ended with status 0; "
                  f"{len(SECRET) + 1} characters, of which 0 may be kept", "recorder.launch folder:=",
                  f"logs/ros: no log file of the robot's nodes in {tmp_path}/.ros/log, {tmp_path}/logs"):
        assert words in notes
        assert words in said
    assert "a.txt" not in notes
    assert "hunter22" not in notes
    assert re.search(r"r\.tar\.gz: [1-9][0-9]* kB;", said)


@pytest.mark.usefixtures("run")
def test_a_full_disk_is_told(monkeypatch, capsys):
    monkeypatch.setattr(report.Report, "text", Mock(side_effect=OSError(28, "No space left on device")))
    assert report.main() == 1
    assert "No space left on device: --output FILE.tar.gz, and TMPDIR, where" in capsys.readouterr().err


def test_logs_are_those_of_own_nodes_without_users_in_addresses(run, tmp_path):
    """rospy writes "Unable to register with master node [http://me:hunter22@...]"."""
    own, words = ("robot1-driver_node-2.log", "driver_node-2-stdout.log"), "[http://{}127.0.0.1:1/]: 3@4 /home/@x"
    (tmp_path / "logs/latest").mkdir(parents=True)
    for name in (*own, "web_teleop_node-3.log", "rosout.log", "roslaunch-host-5.log", "fleet_node-1.log",
                 "driver_node_of_mine-1.log", "master.log"):
        (tmp_path / "logs/latest" / name).write_text(words.format("me:hunter22@") if name in own else SECRET)
    _, found = run()
    logs = {name.rpartition("/")[2]: text for name, text in found.items() if "/logs/" in name}
    assert logs == dict.fromkeys(own, words.format(""))
    assert not [name for name, text in found.items() if "hunter22" in text]


def test_parameters_are_numbers_and_names_of_own_tables():
    given = {**SHIPPED, "wheelRadius": SECRET, "run_id": SECRET, "robot": SECRET, "mine": {"deep": {"x": SECRET}},
             "driver_node": {"publish_rate": 20.0, "cmd_timeout": SECRET, "unheard_of": SECRET},
             "r1": {"serial_com_node": {"port": "/dev/robotont", "packets": SECRET, "password": SECRET}},
             "web_teleop_node": {"token": SECRET}}
    found = yaml.safe_dump(report.own_parameters(given))
    assert "hunter22" not in found
    for words in ("publish_rate: 20.0", "port: /dev/robotont", "wheelAmount: 3", "pidControlFrequency: 50"):
        assert words in found


def test_of_the_black_box_numbers_remain_and_what_own_nodes_say_of_themselves():
    def left(topic, message):
        data = io.BytesIO()
        message.serialize(data)
        return report.kept(topic, (message._type, data.getvalue(), message._md5sum, None, type(message)))
    own = DiagnosticStatus(name="r1/serial_com_node: link", message="OK")
    others = DiagnosticStatus(name="mine: x", message=SECRET, values=[KeyValue(SECRET, SECRET)])
    assert left("/diagnostics", DiagnosticArray(status=[own, others])).status == [own]
    assert left("/r1/serial_read", String("1:2:3;")) == String("1:2:3;")
    assert isinstance(left("/cmd_vel", Twist()), Twist)
    assert left("/rosout", Log(msg=SECRET)) is None
    assert left("/cmd_vel/driven_by", String(SECRET)) is None
    assert left("/mine/serial_read", String(SECRET)) is None


@pytest.mark.parametrize("file, line, kept", [
    ("kernel", "[Thu Nov 26 12:00:00 2026] usb 1-1.4: new full-speed USB device", True),
    ("kernel", "[    1.5] cdc_acm 1-1:1.2: ttyACM0: USB ACM device", True),
    ("kernel", f"[Thu Nov 26 12:00:00 2026] Kernel command line: usb-storage.quirks=1 token={SECRET}", False),
    ("kernel", f"[Thu Nov 26 12:00:00 2026] myd: {SECRET} usb 1-1: x", False),
    ("journal", "Nov 26 12:00:00.123456 host env[12]: [WARN] [1764158400.123]: x /driver_node: y", False),
    ("journal", "Nov 26 12:00:00.123456 host env[12]: \x1b[33m[WARN] [1764158400.123] /r1/driver_node: words", True),
    ("journal", f"Nov 26 12:00:00.1 host env[12]: [INFO] [1.1] /web_teleop_node: {SECRET} [x] /driver_node: y", False),
    ("journal", "Nov 26 12:00:00.1 host env[12]: [driver_node-2] process has died [pid 5, exit code -9", True),
    ("journal", f"Nov 26 12:00:00.1 h env[12]: {SECRET} [driver_node-2] process has died [pid 5, exit code 1", False),
])
def test_of_others_lines_are_kept_only_those_that_begin_as_one_that_is_wanted(file, line, kept):
    assert (re.match(report.COMMANDS[f"logs/{file}.txt"][1], line) or [""])[0] == line * kept

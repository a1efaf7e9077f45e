"""Every program that takes a wheel file or a robot answers a wrong one alike: status 1, a message, the file's name."""

import re
import runpy
import sys
from pathlib import Path

import pytest
import rosbag
import rospy
from std_msgs.msg import String

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = {
    "robotont_calibration/scripts/calibrate_wheels": ["--wheel-params", "FILE", "square=DRIVE"],
    "robotont_calibration/scripts/odometry_report": ["DRIVE", "--wheel-params", "FILE"],
    "robotont_description/scripts/describe": ["robot:=FOLDER"],
    "robotont_description/scripts/robot_radius": ["robot:=FOLDER"],
    "robotont_calibration/scripts/turned_wheels": ["robot:=FOLDER"],
}


@pytest.mark.parametrize("content, words", [
    (None, "No such file or directory"),
    (b"# Rads\xe4tze\nwheelAmount: 3\n", "found the byte 0xe4 in line 1, allowed: text in UTF-8"),
    (b"wheelAmount: 2\n", "wheelAmount: found 2, allowed: a whole number from 3 to 16"),
], ids=["missing", "latin_1", "two_wheels"])
@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: Path(program).name)
def test_a_wrong_wheel_file(program, content, words, tmp_path, monkeypatch, capsys):
    file, drive = tmp_path / "wheel_params.yaml", tmp_path / "drive.bag"
    with rosbag.Bag(str(drive), "w") as bag:
        for second in (1, 2):
            bag.write("serial_read", String("1:2:3;"), rospy.Time(second))
    if content is not None:
        file.write_bytes(content)
    names = {"FILE": str(file), "FOLDER": str(tmp_path), "DRIVE": str(drive)}
    arguments = [re.sub("FILE|FOLDER|DRIVE", lambda match: names[match.group()], word) for word in PROGRAMS[program]]
    monkeypatch.setattr(sys, "argv", [program, *arguments])
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(ROOT / program), run_name="__main__")
    message = capsys.readouterr().err if end.value.code == 1 else end.value.code  # sys.exit(message) prints it
    assert message.startswith(f"{Path(program).name}: ")
    assert str(file) in message
    assert words in message

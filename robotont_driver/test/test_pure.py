import subprocess
import sys

import pytest

from conftest import HERE

DIALECTS = ["dialects." + name for name in ("board_wheels", "checked", "dialect", "plain", "pose_feedback",
                                            "recognition", "robotont2", "robotont2018", "robotont3")]
PURE = [*DIALECTS, "command_stream", "echo", "ideal_motors", "kinematics", "limits", "motor", "odometry", "outbox",
        "parameters", "protocol", "scan_sectors", "se2", "slip", "solvers", "stall_watch", "timeouts", "travelled_path",
        "wheel_file", "wheel_noise", "wheels", "yaml_file"]
FORBIDDEN = ["rospy", "roslib", "genpy", "serial", "time", "threading", "socket", "std_msgs"]


@pytest.mark.parametrize("module", PURE)
def test_pure_modules_know_no_ros_no_port_and_no_clock(module):
    """The imports of the module itself, seen in its source: numpy and others may use what they like."""
    source = (HERE.parent / "src" / "robotont_driver" / (module.replace(".", "/") + ".py")).read_text()
    imports = [line.split()[1].split(".")[0] for line in source.splitlines()
               if line.startswith(("import ", "from "))]
    assert not set(imports) & set(FORBIDDEN)


def test_pure_modules_load_where_there_is_no_ros():
    code = "import sys; sys.modules.update(rospy=None, serial=None); import {}".format(
        ", ".join("robotont_driver." + module for module in PURE))
    subprocess.run([sys.executable, "-c", code], check=True, cwd=str(HERE.parent / "src"))

import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "robotont_driver"
IMPURE = {"clocks", "imu_input", "kept_parameter", "node", "official_topics", "outages", "packet_topics", "rospy_end",
          "scan_to_distance", "serial_link", "turned_wheels", "which_robot"}
MODULES = [".".join(path.relative_to(SOURCE).with_suffix("").parts) for path in SOURCE.rglob("*.py")]
PURE = sorted(module for module in MODULES
              if module not in IMPURE and not module.endswith(("_node", "__init__")))
FORBIDDEN = ["rospy", "roslib", "genpy", "serial", "time", "threading", "socket", "std_msgs"]


@pytest.mark.parametrize("module", PURE)
def test_pure_modules_use_no_ros_no_port_and_no_clock(module):
    """The imports of the module itself, seen in its source: numpy and others may use what they like."""
    source = (SOURCE / (module.replace(".", "/") + ".py")).read_text()
    imports = [line.split()[1].split(".")[0] for line in source.splitlines()
               if line.startswith(("import ", "from "))]
    assert not set(imports) & set(FORBIDDEN)


def test_pure_modules_load_where_there_is_no_ros():
    code = "import sys; sys.modules.update(rospy=None, serial=None); import {}".format(
        ", ".join("robotont_driver." + module for module in PURE))
    subprocess.run([sys.executable, "-c", code], check=True, cwd=str(SOURCE.parent))

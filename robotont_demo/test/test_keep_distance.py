"""What examples/keep_distance.py answers to one scan; before a wall: `rostest_examples.py`."""

import math
import runpy
from pathlib import Path
from unittest.mock import MagicMock, patch

import pytest
from sensor_msgs.msg import LaserScan

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "keep_distance.py"


@pytest.mark.parametrize("first", [-0.5, 2 * math.pi - 0.5])
@pytest.mark.parametrize("ahead, beside, speed", [
    (-math.inf, math.inf, -0.2), (-math.inf, 3.0, -0.2), (0.4, math.inf, -0.1), (2.0, 0.4, 0.2),
    (math.inf, 0.4, 0.2), (math.nan, math.inf, 0.0), (9.0, 9.0, 0.0)])
def test_the_command_follows_from_what_is_ahead_alone(ahead, beside, speed, first):
    """A post that is nearer than the sensor measures: the example drove on, for beside it there was nothing."""
    rospy = MagicMock()
    with patch.dict("sys.modules", rospy=rospy):
        runpy.run_path(str(EXAMPLE))
    on_scan = rospy.Subscriber.call_args[0][2]
    on_scan(LaserScan(angle_min=first, angle_increment=0.1, range_min=0.3, range_max=4.0,
                      ranges=[beside] * 3 + [ahead] * 5 + [beside] * 3))
    assert rospy.Publisher.return_value.publish.call_args[0][0].linear.x == pytest.approx(speed)

"""Maps by gmapping in slam.launch with the camera, against the true faces of the worlds; if gmapping is installed."""

import json
import subprocess

import pytest
from mapping_route import ROUTES
from navigation_tools import PACKAGE, lacking

NO_GMAPPING = lacking("gmapping")


@pytest.mark.long
@pytest.mark.skipif(bool(NO_GMAPPING), reason=NO_GMAPPING or "-")
@pytest.mark.parametrize("name", ROUTES)
def test_gmapping_draws_nine_of_ten_wall_cells_within_0_1_m_of_the_true_faces(name):
    program, world = (str(PACKAGE / "test" / path) for path in ("mapping_run.py", f"data/{name}.yaml"))
    result = subprocess.run(["/usr/bin/python3", program, world, "imu:=imu"], check=False, text=True, timeout=1800,
                            capture_output=True)
    assert result.stdout, result.stderr
    figures = json.loads(result.stdout)
    print(figures)
    assert figures["p90_m"] <= 0.10, figures
    assert figures["recall"] >= 0.9, figures

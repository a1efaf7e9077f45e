"""Maps by gmapping in slam.launch with the camera, against the true faces of the worlds; if gmapping is installed."""

import pytest
from navigation_tools import PACKAGE, figures_of, needs


@pytest.mark.long
@needs("gmapping")
@pytest.mark.parametrize("name", ["mapping_flat", "mapping_ring"])
def test_gmapping_draws_nine_of_ten_wall_cells_within_0_1_m_of_the_true_faces(name):
    figures = figures_of("mapping_run.py", str(PACKAGE / "test" / "data" / f"{name}.yaml"), "imu:=imu", timeout=1800)
    print(figures)
    assert figures["p90_m"] <= 0.10, figures
    assert figures["recall"] >= 0.9, figures

"""A map by gmapping in slam.launch with the camera, against the true faces of the world; if gmapping is installed."""

import pytest
from navigation_tools import figures_of, needs


@pytest.mark.long
@needs("gmapping")
def test_gmapping_draws_nine_of_ten_wall_cells_within_0_1_m_of_the_true_faces():
    figures = figures_of("mapping_run.py", "imu:=imu", timeout=1800)
    print(figures)
    assert figures["p90_m"] <= 0.10, figures
    assert figures["recall"] >= 0.9, figures

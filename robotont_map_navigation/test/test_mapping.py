"""Maps by slam.launch, against the true faces of the worlds; gmapping itself runs in the long test, if installed."""

import json
import subprocess

import numpy as np
import pytest
from map_score import moved, score
from mapping_route import ROUTES
from navigation_tools import PACKAGE, lacking

from robotont_simulator.world import OCCUPIED, draw_map, read_world

WORLDS = {name: PACKAGE / "test" / "data" / f"{name}.yaml" for name in ROUTES}
NO_GMAPPING = lacking("gmapping")


def true_walls(world):
    """n x 2 [m], the middles of the occupied cells of the world's own map, 0.05 m wide."""
    image, origin = draw_map(world)
    return (np.argwhere(image[::-1] == OCCUPIED)[:, ::-1] + 0.5) * 0.05 + origin


@pytest.mark.parametrize("name", ROUTES)
def test_the_score_finds_a_true_map_that_was_turned_and_moved(name):
    world = read_world(WORLDS[name])
    figures = score(moved(true_walls(world), (0.2, -0.1, 0.1)), world, (0.0, 0.0, 0.0))
    assert figures["p90_m"] <= 0.05, figures
    assert figures["precision"] == 1.0, figures
    assert figures["recall"] == 1.0, figures
    np.testing.assert_allclose(figures["moved"][2], -0.1, atol=0.005)


def test_the_score_tells_a_wall_that_is_doubled_and_one_that_is_missing():
    world = read_world(WORLDS["mapping_flat"])
    walls = true_walls(world)
    right = walls[walls[:, 0] > 6.5]
    doubled = score(np.vstack([walls, right - (0.3, 0.0)]), world, (0.0, 0.0, 0.0))
    halved = score(walls[walls[:, 0] < 4.0], world, (0.0, 0.0, 0.0))
    assert doubled["p90_m"] > 0.15, doubled
    assert halved["p90_m"] <= 0.05, halved
    assert halved["recall"] < 0.6, halved


@pytest.mark.long
@pytest.mark.skipif(bool(NO_GMAPPING), reason=NO_GMAPPING or "-")
@pytest.mark.parametrize("name", ROUTES)
def test_gmapping_with_the_camera_draws_nine_of_ten_wall_cells_within_0_1_m_of_the_true_faces(name):
    program = str(PACKAGE / "test" / "mapping_run.py")
    result = subprocess.run(["/usr/bin/python3", program, str(WORLDS[name]), "imu:=imu"], check=False, text=True,
                            timeout=1800, capture_output=True)
    assert result.stdout, result.stderr
    figures = json.loads(result.stdout)
    print(figures)
    assert figures["p90_m"] <= 0.10, figures
    assert figures["recall"] >= 0.9, figures

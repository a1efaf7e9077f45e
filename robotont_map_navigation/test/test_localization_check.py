"""What navigation_monitor says of scans, and of the room that it makes at walls; without a master and its time."""

import math

import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion
from navigation_messages import Monitor, grid, ranges_in_box, scan_of, walled

from robotont_driver.kinematics.se2 import pose_of
from robotont_map_navigation.localization_check import LOOK_PERIOD
from robotont_testing.node_test import ERROR, OK, WARN, twist

RIGHT = 0.5, 0.0, 0.3  # where the sensor is
ALL = ranges_in_box(RIGHT, -3.0, 3.0, -1.0, 1.0)  # [m] what it sees
HALF = np.where(np.arange(90) < 50, ALL, 0.4)  # beside something that the map lacks
GONE = np.where(np.arange(90) < 66, ALL, ALL + 1.0)  # a wall of the map is gone: its rays end a metre behind it
WELL = OK, "the map explains 100% of the scan's rays"
FILLS = WARN, "the others end before its walls: something that the map lacks fills the view"
WRONG = ERROR, "of driving: a map of another place, or a wrong pose"


class Seeing(Monitor):
    """Its sensor really is at RIGHT."""

    def look(self, ranges=ALL, seconds=4.0):
        """(level, words) of the diagnostics, and what goto is told, after a while."""
        for _ in range(round(seconds / LOOK_PERIOD)):
            if ranges is not None:
                self.hear("scan", scan_of(ranges))
            self.sleep(LOOK_PERIOD)
        return (*self.reports["localization"]()[:2], self.sent["localization/trouble"][-1].data)


@pytest.fixture
def monitor(monkeypatch):
    monitor = Seeing(monkeypatch)
    monitor.stand(*RIGHT)
    return monitor


def says(found, expected):
    assert found[0] == expected[0], found
    assert expected[1] in found[1]
    assert (expected[1] in found[2]) == (found[0] == ERROR)


@pytest.mark.parametrize("ranges, expected", [
    (ALL, WELL), (HALF, FILLS), (np.minimum(ALL, 0.4), (WARN, "the map explains 0% of the scan's rays, the others")),
    (GONE, (WARN, "go through its walls: the room has changed, or the pose is wrong")),
    (np.full(90, math.nan), (OK, "nothing to compare")), (None, (WARN, "no scan for 4 s: does its sensor run?"))])
def test_what_is_seen_from_a_right_pose_is_no_trouble(monitor, ranges, expected):
    says(monitor.look(ranges), expected)
    assert bool(monitor.sent["navigation/stand"]) == (ranges is None), "a sensor that is there, and silent"


@pytest.mark.parametrize("comes", [False, True])
def test_navigation_stands_while_a_scan_is_gone_whoever_tells_the_pose(monitor, comes):
    monitor.connections["scan"] = 0
    says(monitor.look(None), (WARN, "no scan yet: does its sensor run? Navigation does not see"))
    assert monitor.sent["navigation/stand"] == [], "who drives without a sensor knows it"
    monitor.connections["scan"] = comes  # also one that has gone with its node
    monitor.look()
    says(monitor.look(None), (WARN, "no scan for 4 s: does its sensor run? Navigation through cmd_vel_mux stands "
                              "until it comes"))
    assert [stand.data for stand in monitor.sent["navigation/stand"]] == [1.0] * 7, "from the second on"
    monitor.look()
    assert len(monitor.sent["navigation/stand"]) == 7


def test_what_the_map_lacks_is_no_fault_until_the_robot_has_driven_with_it_for_long(monitor):
    for number in range(8):
        monitor.stand(RIGHT[0] - 0.3 * (number % 2), 0.0, 0.3)
        says(monitor.look(GONE, 0.5), (WARN, "the room has changed"))
    near = np.minimum(ALL, 0.4)
    monitor.look(near)
    monitor.stand(-0.7, 0.0, 0.3)
    says(monitor.look(near), (WARN, "the others end before its walls"))
    monitor.stand(-1.2, 0.0, 0.3)
    says(monitor.look(near), WRONG)


@pytest.mark.parametrize("place, ranges", [(-1.5, np.full(90, math.nan)), (-9.5, None), (-1.5, ALL)])
def test_a_pose_that_a_person_has_set_counts_whatever_the_scan_shows(monitor, place, ranges):
    monitor.look()
    monitor.stand(place, 0.0, 1.2)
    assert (monitor.look()[0], monitor.look(ranges)[2] != "") == (ERROR, True), "as it was"
    monitor.hear("initialpose", PoseWithCovarianceStamped())
    monitor.look(None)
    monitor.later(0.75, monitor.stand, *RIGHT, 2.0)  # amcl obeys with its next scan, of which this hears before
    level, _, told = monitor.look(ranges)
    assert (level == ERROR, told, monitor.sent["initialpose"]) == (False, "", [])


def test_a_wrong_pose_cancels_what_drives_until_a_person_has_set_it(monitor):
    monitor.hear("cmd_vel", twist(0.2))
    monitor.look()
    monitor.stand(-1.5, 0.0, 1.2)
    says(monitor.look(), WRONG)
    monitor.hear("cmd_vel", twist())
    assert monitor.sent["move_base/cancel"] == []
    monitor.hear("cmd_vel", twist(0.2))
    assert len(monitor.sent["move_base/cancel"]) == 1
    monitor.hear("initialpose", PoseWithCovarianceStamped())
    monitor.stand(*RIGHT, odometry=2.0)
    says(monitor.look(), WELL)


def test_a_pose_where_no_robot_can_be_is_wrong(monitor):
    monitor.stand(50.0, 0.0, 0.0)
    says(monitor.look(), (ERROR, "the pose (50.00, 0.00) is off the map, which is 6.1 m x 2.1 m large"))


def test_a_map_whose_origin_is_turned_is_told(monitor):
    turned = grid(walled(42, 122), -3.05, -1.05)
    turned.info.origin.orientation = Quaternion(z=math.sin(0.25), w=math.cos(0.25))
    monitor.hear("map", turned)
    monitor.stand(-2.2, 0.55, 0.3)
    level, words, _ = monitor.look(np.full(90, math.nan))
    assert (level, words[:33]) == (ERROR, "the map's origin has a yaw, which")


def test_a_pose_that_slides_away_is_wrong_even_when_it_fits_then(monitor):
    says(monitor.look(HALF), FILLS)
    monitor.stand(1.6, 0.0, 0.3, odometry=1.1)
    slid = ERROR, "the localization has moved the pose by 1.1 m"
    says(monitor.look(HALF), slid)
    level, words, _ = monitor.look()
    assert (level, words.partition(":")[0]) == (ERROR, "the map explains 76% of the scan's rays, but " + slid[1])


def test_a_pose_that_jumps_is_put_back_where_the_odometry_has_it_once(monitor):
    monitor.stand(-0.4, 0.0, 0.3)
    monitor.look(np.full(90, math.nan))
    monitor.stand(*RIGHT)
    monitor.look(np.full(90, math.nan))  # it drives where nothing is seen, from its start on
    monitor.stand(1.6, 0.0, 0.3, odometry=1.1)
    assert monitor.look(seconds=0.5)[2] == ""
    told, = monitor.sent["initialpose"]
    assert (told.header.frame_id, pose_of(told.pose.pose)) == ("map", pytest.approx(RIGHT))
    monitor.hear("initialpose", told)
    monitor.stand(*RIGHT)  # amcl obeys
    says(monitor.look(), WELL)
    monitor.stand(1.6, 0.0, 0.3, odometry=1.1)
    says(monitor.look(), (ERROR, "the localization has moved the pose by 1.1 m"))
    says(monitor.look(seconds=90.0), (ERROR, "the localization has moved the pose by 1.1 m"))
    assert len(monitor.sent["initialpose"]) == 1, "the second time it may be right"
    monitor.stand(*RIGHT)
    says(monitor.look(seconds=60.0), WELL)
    monitor.stand(1.6, 0.0, 0.3, odometry=1.1)
    assert (monitor.look(seconds=1.0)[2], len(monitor.sent["initialpose"])) == ("", 2)


def test_a_reset_of_the_odometry_puts_no_pose_elsewhere(monitor):
    monitor.look()
    monitor.stand(2.0, 0.0, 0.3)  # the odometry's new place, laid where its frame was
    monitor.look(seconds=LOOK_PERIOD)  # the localization hears of it a look later
    monitor.stand(*RIGHT, odometry=RIGHT[0] - 2.0)
    says(monitor.look(), (ERROR, "the localization has moved the pose by 1.5 m"))
    assert not monitor.sent["initialpose"]


def test_who_comes_late_hears_the_maps_and_what_is_wrong(monitor):
    assert monitor.latched == {"map_for_amcl", "map_for_planning", "navigation/held", "localization/trouble"}


def test_transforms_that_are_late_for_a_moment_are_no_fault(monitor):
    says(monitor.look(), WELL)
    monitor.places.clear()
    says(monitor.look(seconds=3.0), WELL)
    says(monitor.look(seconds=1.0), (WARN, "the scan cannot be laid on the map"))


def test_updates_of_the_map_wait_until_all_have_one_of_another_size(monitor):
    def updates(cells, seconds):
        """Those that have come within a time after a map."""
        monitor.sent.clear()
        monitor.hear("map", grid(cells, -1.0, -1.0))
        monitor.sleep(seconds)
        return monitor.sent["map_for_planning_updates"]
    monitor.stand(-0.88, 0.5, 0.0)
    assert updates(walled(60, 80), 1.9) == []
    assert updates(walled(60, 80), 1.5) != []
    assert updates(walled(50, 70), 1.9) == []
    monitor.sleep(0.2)
    newest = monitor.sent["map_for_planning_updates"][-1]
    assert (newest.header.frame_id, newest.x) == ("map", 0)
    assert 0 in newest.data


def test_amcl_gets_the_middles_of_cells_for_their_corners_and_navfn_a_map_that_is_wide_enough(monitor):
    """A way of navfn has 4 points per column, half a cell apart."""
    corridor = walled(360, 30)
    monitor.hear("map", grid(corridor, 1.0, 2.0))
    exact, wide = (monitor.sent[f"map_for_{who}"] for who in ("amcl", "planning"))
    for maps, corner in (exact, (1.025, 2.025)), (wide, (1.0, 2.0)):
        place = maps[-1].info.origin.position
        assert (place.x, place.y) == pytest.approx(corner)
    assert 2 * wide[-1].info.width > 2 * (360 + 30) - 1
    cells = np.reshape(wide[-1].data, (360, wide[-1].info.width))
    np.testing.assert_array_equal(cells[:, :30], corridor)
    assert (cells[:, 30:] == -1).all()
    assert wide[0].info.width == 122

"""Every ordered pair of robots, one behind the other on one master, in 10 min; test_robots.py tries one pair."""

import xmlrpc.client

import numpy as np
import pytest
from test_robots import NAMES, Rig

from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors
from robotont_testing.harness import Master
from robotont_testing.official_boards import BOARDS
from robotont_testing.stand_in_board import Board

pytestmark = pytest.mark.long
ROBOTS = [*NAMES, "driver_basic"]


def board(name, link):
    """The board of a robot."""
    if name in BOARDS:
        return BoardPort(link, lambda now: BOARDS[name](Motors(), start=now))
    return Board(link, 4 if name == "four_wheels" else 3)


def forget(master):
    """All parameters, as a new master."""
    server = xmlrpc.client.ServerProxy(master.uri)
    for key in set(server.getParam("/rig", "/")[2]) - {"run_id"}:
        server.deleteParam("/rig", "/" + key)


def each_behind_each(names):
    """A walk in which each name stands once behind each other one."""
    walk = names[:1]
    for turn, name in enumerate(names):
        for other in (*names[1:turn], *(names[:1] if turn else ())):
            walk = [*walk, name, other]
    return walk


def test_each_robot_drives_behind_each_other_one_as_alone():
    walk = each_behind_each(ROBOTS)
    with Master() as master:
        rig, link = Rig(master), str(master.folder / "board")
        alone = {name: forget(master) or rig.behaviour(name, board(name, link)) for name in ROBOTS}
        forget(master)
        for turn, name in enumerate(walk):
            found = rig.behaviour(name, board(name, link), rig.disturb if turn % 2 and name in NAMES else lambda: None)
            assert found[1:] == alone[name][1:], f"{name} behind {walk[turn - 1]}"
            np.testing.assert_allclose(found[0], alone[name][0], atol=0.02, err_msg=f"{name} behind {walk[turn - 1]}")

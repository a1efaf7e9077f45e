"""Who moves the robot, in virtual time."""

from unittest.mock import MagicMock

import pytest

from robotont_teleop.hand.movers import RECENT, Movers

PAGE, MUX = "/web_teleop_node", "/cmd_vel_mux"


@pytest.mark.parametrize("commands, driven_by, who", [
    ([], "nobody", ("nobody", "")),
    ([("cmd_vel", MUX), ("cmd_vel/hand", PAGE)], "hand", ("page", "")),
    ([("cmd_vel", MUX), ("cmd_vel/hand", "/keyboard_teleop_1")], "hand", ("hand", "keyboard_teleop_1")),
    ([("cmd_vel", MUX), ("cmd_vel/navigation", "/move_base")], "navigation", ("navigation", "move_base")),
    ([("cmd_vel", MUX), ("cmd_vel/default", "/square")], "default", ("program", "square")),
    ([("cmd_vel", "/square")], "nobody", ("program", "square")),
    ([("cmd_vel", "/square"), ("cmd_vel", MUX), ("cmd_vel/hand", PAGE)], "hand", ("program", "square")),
    ([("cmd_vel/hand", PAGE)], "nobody", ("nobody", "")),
])
def test_who(commands, driven_by, who):
    movers = Movers(PAGE, MUX)
    for topic, sender in commands:
        movers.hear(topic, sender, True, 10.0)
    assert movers.who(driven_by, 10.0 + RECENT - 0.01) == who
    assert movers.who("nobody", 10.01 + RECENT) == ("nobody", "")
    for topic, sender in commands:
        movers.hear(topic, sender, False, 10.1)
    assert movers.who("nobody", 10.2) == ("nobody", "")


def test_who_starts_while_it_is_asked_ends_nothing():
    movers, now = Movers(PAGE, MUX), MagicMock()  # a time at whose comparison another thread has its turn
    now.__sub__.side_effect = lambda _at: movers.hear("cmd_vel/hand", "/keys", True, 10.1) or 0.1
    movers.hear("cmd_vel/hand", PAGE, True, 10.0)
    assert movers.who("hand", now) == ("page", "")

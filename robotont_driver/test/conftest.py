"""What the tests of this folder share."""

import pytest
from hypothesis import Phase, settings

from robotont_boards import BOARDS
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors
from robotont_testing.robots import ROBOTS

settings.register_profile("shared machine", deadline=None)
settings.load_profile("shared machine")
# for ./robotont test --mutants: the same examples each time, and no search for the smallest one
settings.register_profile("mutants", deadline=None, derandomize=True, database=None,
                          phases=(Phase.explicit, Phase.generate))


@pytest.fixture(scope="module", params=ROBOTS.values(), ids=ROBOTS.keys())
def wheels(request):
    """Robots with three, four and five wheels."""
    return read_wheels(request.param)


@pytest.fixture
def official_board(tmp_path):
    """Plugs in an official board, by its protocol's name; its `BoardPort`."""
    ports = []

    def plugged(name):
        ports.append(BoardPort(str(tmp_path / "board"), lambda now: BOARDS[name](Motors(), start=now)))
        ports[-1].plug()
        return ports[-1]
    yield plugged
    for port in ports:
        port.unplug()


@pytest.fixture(scope="module")
def shared_presses(request):
    """Robots of these names beside a network, and buttons behind it; a module's tests share them."""
    from presses import Presses  # here: no other test needs namespaces

    with Presses(request.param) as both:
        yield both


@pytest.fixture
def presses(shared_presses):
    """The same, without the buttons of the test before."""
    yield shared_presses
    shared_presses.kill_buttons()

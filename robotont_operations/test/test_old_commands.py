"""Commands that waited on their way, and those from long ago, move nothing when the way is free again."""

import os
import shutil
import signal
import time

import pytest
from histories import ALLOWED, LATCHED, Stage

from robotont_testing.harness import wait_for
from robotont_testing.two_machines import NoNamespacesError

pytestmark = pytest.mark.timed
LATE = 1.0   # [s] besides the length of an outage, within which TCP brings what waited


MUX, BARE = "mux", "no mux"
MUX_FAR, BARE_FAR = MUX + ", master far away", BARE + ", master far away"
either = pytest.mark.parametrize("stage", [MUX, pytest.param(BARE, marks=pytest.mark.nightly)], indirect=True)
with_mux = pytest.mark.parametrize("stage", [MUX], indirect=True)


@pytest.fixture(scope="module")
def stage(request):
    for name in ("ROS_IP", "ROS_HOSTNAME", "ROS_MASTER_URI"):
        os.environ.pop(name, None)
    if not shutil.which("nft"):
        pytest.skip("no nft: sudo apt-get install nftables")
    try:
        mux = request.param in (MUX, MUX_FAR)
        both = Stage(mux, "laptop" if request.param in (MUX_FAR, BARE_FAR) else "robot")
    except NoNamespacesError as error:
        pytest.skip(str(error))
    with both:
        yield both


@pytest.fixture(autouse=True)
def in_order(stage):
    yield
    stage.resume()
    stage.mend()
    for who in range(3):
        stage.kill(who)


def nothing_moves(stage, seconds, allowed=ALLOWED):
    """Nothing older than `allowed` [s]. For how long, is what these tests are about."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        assert [motion for motion in stage.motions() if motion[1] > allowed] == []
        time.sleep(0.02)


def stands(stage):
    wait_for(lambda: not any(stage.board.speeds), "the stop")
    stage.motions()


def others_drive(stage):
    """The robot is not deaf."""
    stage.command(1, "drive")
    stage.drives(1)
    stage.kill(1)


def connections(stage):
    """How often subscribers have connected to the publisher that latches."""
    return stage.commander_log(LATCHED).count("connected")


@pytest.fixture
def latched(stage):
    """A command from long ago, whose publisher is still there; how often subscribers had connected to it."""
    stage.command(LATCHED, "once", latch=True)
    wait_for(lambda: connections(stage), "the connection")
    time.sleep(1.0)  # its age
    stands(stage)
    return connections(stage)


@pytest.mark.parametrize("stage, outage, how", [
    pytest.param(BARE, 1.2, signal.SIGKILL, marks=pytest.mark.nightly), (MUX, 2.0, signal.SIGSTOP), *(
    pytest.param(stage, outage, how, marks=pytest.mark.long) for stage in (MUX, BARE)
    for outage, how in ((3.0, signal.SIGINT), (10.0, signal.SIGKILL)))], indirect=["stage"])
def test_what_waited_for_the_network_does_not_drive(stage, outage, how):
    stage.command(0, "drive")
    stage.drives(0)
    stage.drop()
    cut = time.monotonic()
    stands(stage)
    (stage.hang if how == signal.SIGSTOP else lambda who: stage.kill(who, how))(0)
    nothing_moves(stage, cut + outage - time.monotonic())
    stage.mend()
    nothing_moves(stage, outage + LATE)
    others_drive(stage)


@either
def test_a_latched_command_drives_neither_after_an_outage_nor_a_node_that_was_killed(stage, latched):
    stage.drop()
    nothing_moves(stage, 3.2)  # long enough to be noticed
    stage.mend()
    wait_for(lambda: connections(stage) > latched, "the new connection")
    nothing_moves(stage, LATE)
    others_drive(stage)
    stands(stage)
    before = connections(stage)
    stage.respawn("cmd_vel_mux" if stage.mux else "driver_node")
    wait_for(lambda: connections(stage) > before, "the connection of the new node")
    nothing_moves(stage, LATE)
    others_drive(stage)


@pytest.mark.nightly
@with_mux
def test_a_latched_command_of_a_publisher_that_hung_does_not_drive(stage, latched):
    stage.hang(LATCHED)
    stage.respawn("cmd_vel_mux" if stage.mux else "driver_node")
    others_drive(stage)  # the new node listens
    time.sleep(2.0)  # longer than a start takes
    stands(stage)
    stage.resume()
    wait_for(lambda: connections(stage) > latched, "the new connection")
    nothing_moves(stage, LATE)


@either
@pytest.mark.parametrize("outage, carrier", [pytest.param(1.0, False, marks=pytest.mark.long), (3.2, True)])
def test_the_robot_stops_at_once_in_an_outage_and_drives_at_once_after_it(stage, outage, carrier):
    board = stage.board
    stage.command(0, "drive")
    stage.drives(0)
    before = time.monotonic()
    stage.cut(carrier)
    wait_for(lambda: not any(board.speeds), "the stop")
    assert time.monotonic() - before <= 0.6
    stage.motions()
    nothing_moves(stage, outage)
    before = time.monotonic()
    stage.mend()
    wait_for(lambda: any(board.speeds), "motion after the outage", 60.0)
    assert time.monotonic() - before <= 2.0
    twice = time.monotonic()
    while time.monotonic() - twice < 1.0:  # and does not stumble
        assert any(board.speeds)
        time.sleep(0.02)


@with_mux
def test_an_emergency_stop_pressed_during_an_outage_is_not_lost(stage):
    stage.command(0, "drive")
    stage.drives(0)
    wait_for(lambda: "can press" in stage.commander_log(0), "the connection")
    stage.cut()
    stands(stage)
    stage.command(0, "press")
    time.sleep(3.0)  # the length of the outage
    stage.mend()
    wait_for(lambda: "emergency stop pressed" in (stage.folder / "robot.log").read_text(), "the emergency stop")
    stands(stage)
    nothing_moves(stage, 0.5, allowed=0.0)
    stage.release()


@pytest.mark.long
@pytest.mark.parametrize("stage", [MUX_FAR, BARE_FAR], indirect=True)
def test_a_press_stops_at_once_while_the_master_is_out_of_reach(stage):
    """While it hangs: test_hung_peers."""
    stage.command(0, "drive", "robot")
    stage.drives(0)
    wait_for(lambda: "can press" in stage.commander_log(0), "the connection")
    stage.cut(carrier=True)
    before = time.monotonic()
    stage.command(0, "press")
    stands(stage)
    assert time.monotonic() - before <= 0.2  # of which the commander may take 0.1
    nothing_moves(stage, 0.5, allowed=0.0)

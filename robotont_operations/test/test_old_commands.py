"""Commands that waited on their way, and those from long ago, move nothing when the way is free again."""

import os
import shutil
import signal
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from histories import ALLOWED, LATCHED, Player, Stage

from robotont_testing.harness import wait_for
from robotont_testing.two_machines import NoNamespacesError

pytestmark = pytest.mark.timed
LATE = 1.0  # [s] besides the length of an outage, within which TCP brings what waited


def stage_for(mux, composed):
    for name in ("ROS_IP", "ROS_HOSTNAME", "ROS_MASTER_URI"):
        os.environ.pop(name, None)
    if not shutil.which("nft"):
        pytest.skip("no nft: sudo apt-get install nftables")
    try:
        return Stage(mux, composed)
    except NoNamespacesError as error:
        return pytest.skip(str(error))


@pytest.fixture(scope="module", params=[True, False], ids=["mux, one process", "no mux, three processes"])
def stage(request):
    with stage_for(request.param, request.param) as both:
        yield both


@pytest.fixture(autouse=True)
def in_order(stage):
    yield
    stage.resume()
    stage.mend()
    for who in range(4):
        stage.kill(who)


def topics(stage):
    return ("cmd_vel/hand", "cmd_vel/default") if stage.mux else ("cmd_vel",)


def nothing_moves(stage, seconds):
    """For how long, is what these tests are about."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        assert stage.motions() == []
        time.sleep(0.02)


def stands(stage):
    wait_for(lambda: not any(stage.board.speeds), "the stop")
    stage.motions()


def others_drive(stage, topic):
    """The robot is not deaf."""
    stage.command(1, "drive", "laptop", topic)
    stage.drives(1)


def connections(stage):
    """How often subscribers have connected to the publisher that latches."""
    return stage.commander_log(LATCHED).count("connected")


def latch(stage, topic):
    """A command from long ago, whose publisher is still there."""
    stage.command(LATCHED, "once", "laptop", topic, latch=True)
    wait_for(lambda: connections(stage), "the connection")
    time.sleep(1.0)  # its age
    stands(stage)


@pytest.mark.parametrize("outage, how", [(1.2, signal.SIGKILL), (3.0, signal.SIGINT), (3.0, signal.SIGSTOP),
                                         (10.0, signal.SIGKILL)])
def test_what_waited_for_the_network_does_not_drive(stage, outage, how):
    topic = topics(stage)[0]
    stage.command(0, "drive", "laptop", topic)
    stage.drives(0)
    stage.drop()
    cut = time.monotonic()
    stands(stage)
    (stage.hang if how == signal.SIGSTOP else lambda who: stage.kill(who, how))(0)
    nothing_moves(stage, cut + outage - time.monotonic())
    stage.mend()
    nothing_moves(stage, outage + LATE)
    others_drive(stage, topic)


def test_a_latched_command_does_not_drive_after_an_outage(stage):
    for topic in topics(stage):
        latch(stage, topic)
        before = connections(stage)
        stage.drop()
        nothing_moves(stage, 1.5)
        stage.mend()
        wait_for(lambda before=before: connections(stage) > before, "the new connection")
        nothing_moves(stage, LATE)
        others_drive(stage, topic)
        stage.kill(1)
        stage.kill(LATCHED)


def test_a_latched_command_does_not_drive_a_node_that_was_killed(stage):
    for topic in topics(stage):
        latch(stage, topic)
        before = connections(stage)
        stage.respawn("cmd_vel_mux" if stage.mux else stage.driver)
        wait_for(lambda before=before: connections(stage) > before, "the new connection")
        nothing_moves(stage, LATE)
        others_drive(stage, topic)
        stage.kill(1)
        stage.kill(LATCHED)


def test_a_latched_command_of_a_publisher_that_hung_does_not_drive(stage):
    topic = topics(stage)[0]
    latch(stage, topic)
    before = connections(stage)
    stage.hang(LATCHED)
    stage.respawn("cmd_vel_mux" if stage.mux else stage.driver)
    others_drive(stage, topic)  # the new node listens
    stage.kill(1)
    time.sleep(2.0)  # longer than a start takes
    stands(stage)
    stage.resume()
    wait_for(lambda: connections(stage) > before, "the new connection")
    nothing_moves(stage, LATE)


def test_whatever_happens_nothing_old_drives(stage):
    player = Player(stage)
    for seed in range(12, 17):
        assert player.play(seed) == [], f"seed {seed}, older than {ALLOWED} s"

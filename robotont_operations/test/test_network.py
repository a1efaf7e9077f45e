"""The network check on two machines out of namespaces: each fault, seen from either side, in one line within 5 s."""

import re
import signal
import time
from contextlib import contextmanager

import pytest

from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.two_machines import ADDRESSES, TwoMachines

ROBOT, LAPTOP = ADDRESSES["robot"], ADDRESSES["laptop"]
MASTER = {"ROS_MASTER_URI": f"http://{ROBOT}:11311"}
NETWORK = ("/usr/bin/python3", places.package("robotont_operations") / "scripts/network")

pytestmark = pytest.mark.timed


@pytest.fixture(scope="module")
def machines():
    with TwoMachines() as two:
        two.hosts("robot", f"127.0.0.1 localhost\n{ROBOT} robot\n")  # it does not know the laptop's name
        two.on("robot", "rosmaster", "--core", "-p", "11311", **two.environment("robot"))
        wait_for(lambda: "the master answers" in check(two, "robot", ROS_IP=ROBOT).stdout, "the master")
        yield two


def check(machines, name, **environment):
    """Run the check on a machine; it must take at most 5 s, whatever is wrong."""
    before = time.monotonic()
    done = machines.run(name, *NETWORK, **{**MASTER, **environment})
    assert time.monotonic() - before <= 5.0
    assert not done.stderr
    return done


def faults(done):
    found = [line.split(None, 1)[1] for line in done.stdout.splitlines() if line.startswith("FAULT")]
    assert done.returncode == bool(found), done.stdout
    return found


def the_fault(machines, **environment):
    """The one that the laptop finds."""
    fault, = faults(check(machines, "laptop", **{"ROS_IP": LAPTOP, **environment}))
    return fault


@contextmanager
def firewall(machines, name, rule, verdict="drop"):
    machines.block(name, rule, verdict)
    try:
        yield
    finally:
        machines.open_firewall(name)


def test_nothing_is_wrong(machines):
    done = check(machines, "laptop", ROS_IP=LAPTOP)
    assert not faults(done), done.stdout
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["ok"] * 4
    assert "agrees within" in done.stdout
    done = check(machines, "robot", ROS_IP=ROBOT)
    assert not faults(done), done.stdout


@pytest.mark.parametrize("environment, kind, remedy", [
    ({"ROS_IP": "10.77.0.99"}, "wrong ROS_IP/ROS_HOSTNAME: ROS_IP=10.77.0.99", "export ROS_IP=10.77.0.2"),
    ({"ROS_HOSTNAME": "laptop"}, "wrong ROS_IP/ROS_HOSTNAME: the master's machine does not reach this one as 'laptop'",
     "export ROS_IP=10.77.0.2"),
    ({"ROS_MASTER_URI": "http://10.99.0.1:11311"}, "master unreachable: no answer from 10.99.0.1", "cable"),
    *(pytest.param(*case, marks=pytest.mark.nightly) for case in (
        ({"ROS_HOSTNAME": "localhost"}, "wrong ROS_IP/ROS_HOSTNAME: ROS_HOSTNAME=localhost", "unset ROS_HOSTNAME"),
        ({"ROS_HOSTNAME": "robot", "ROS_IP": LAPTOP}, "wrong ROS_IP/ROS_HOSTNAME: ROS_HOSTNAME=robot",
         "unset ROS_HOSTNAME"),
        ({"ROS_MASTER_URI": "http://robto:11311"}, "unresolvable name: this machine finds no address of 'robto'",
         "/etc/hosts"),
        ({"ROS_MASTER_URI": "robot:11311"}, "wrong ROS_MASTER_URI", "export ROS_MASTER_URI=http://"),
        ({"ROS_MASTER_URI": ""}, "master unreachable: no process listens at port 11311 of this machine itself",
         "on a laptop: export ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:11311; on the robot: start the stack"),
        ({"ROS_MASTER_URI": f"http://{ROBOT}:11399"},
         "master unreachable: 10.77.0.1 answers, but no process listens at port 11399", "start the robot's stack")))
])
def test_wrong_settings_on_the_laptop(machines, environment, kind, remedy):
    fault = the_fault(machines, **environment)
    assert fault.startswith(kind)
    assert remedy in fault


IN = "there.* sudo ufw allow from 10.77.0.2"


@pytest.mark.parametrize("verdict, words", [
    ("drop", f"no answer from 10.77.0.1 port 11311: .*firewall: {IN}"),
    pytest.param("reject with tcp reset", f"10.77.0.1 answers, but .*firewall there rejects.*{IN}",
                 marks=pytest.mark.nightly)])
def test_the_robots_firewall_before_the_master(machines, verdict, words):
    with firewall(machines, "robot", "tcp dport 11311", verdict):
        assert re.match("master unreachable: " + words, the_fault(machines))


def registered(machines):
    ask = "import xmlrpc.client; print(xmlrpc.client.ServerProxy('http://10.77.0.1:11311').getSystemState('/test'))"
    return machines.run("robot", "/usr/bin/python3", "-c", ask).stdout


def test_one_way_traffic_and_nothing_stays_registered(machines):
    with firewall(machines, "laptop", "ct state new"):
        fault = the_fault(machines)
        assert fault.startswith("one-way traffic: this machine reaches 10.77.0.1, but not the other way round")
        assert "on this machine, sudo ufw allow from 10.77.0.1" in fault
        assert "robotont_network" not in registered(machines)
        process = machines.on("laptop", *NETWORK, ROS_IP=LAPTOP, **MASTER)
        wait_for(lambda: "robotont_network" in registered(machines), "the way back")
        process.send_signal(signal.SIGINT)
        assert process.wait(2.0) == 130
        assert "robotont_network" not in registered(machines)
    wait_for(lambda: not faults(check(machines, "laptop", ROS_IP=LAPTOP)), "the end of the fault", timeout=60)


def test_clocks_apart(machines):
    late = (*NETWORK[:1], "-c", "import sys, time; now = time.time; time.time = lambda: now() - 3; "
            "from robotont_operations.network import main; sys.argv = ['network']; main()")
    fault, = faults(machines.run("laptop", *late, **{**MASTER, "ROS_IP": LAPTOP}))
    ahead = re.match("clocks apart: that of 10.77.0.1 is (.*) s ahead of this machine's", fault)[1]
    assert float(ahead) == pytest.approx(3.0, abs=0.2)  # as exact as it promises, on a machine with much to do
    assert "chrony" in fault


def test_the_robot_keeps_to_itself(machines):
    done = check(machines, "robot", ROS_IP="127.0.0.1")
    assert not faults(done)
    assert "this machine keeps to itself" in done.stdout
    assert "install-robot --network" in done.stdout

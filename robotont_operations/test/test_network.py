"""The network check on two machines out of namespaces: each fault, seen from either side, in one line within 5 s."""

import re
import socketserver
import subprocess
import sys
import threading
import time

import pytest

from robotont_operations.network import master_answers
from robotont_testing import places
from robotont_testing.harness import wait_for
from robotont_testing.two_machines import ADDRESSES, TwoMachines

ROBOT, LAPTOP = ADDRESSES["robot"], ADDRESSES["laptop"]
SCRIPT = (places.package("robotont_operations") / "scripts/network",)
LATE = ("-c", "import sys, time; now = time.time; time.time = lambda: now() - 3; "
        "from robotont_operations.network import main; sys.argv = ['network']; main()")
IN = "there.* sudo ufw allow from 10.77.0.2"

pytestmark = pytest.mark.timed


@pytest.fixture(scope="module")
def machines():
    with TwoMachines() as two:
        two.hosts("robot", f"127.0.0.1 localhost\n{ROBOT} robot\n")  # it does not know the laptop's name
        two.on("robot", "rosmaster", "--core", "-p", "11311", **two.environment("robot"))
        wait_for(lambda: "the master answers" in check(two, "robot")[1], "the master")
        yield two


def check(machines, name, program=SCRIPT, **environment):
    """(Its faults, all that it prints) of the check on a machine; it takes at most 5 s, whatever is wrong."""
    before = time.monotonic()
    done = machines.run(name, "/usr/bin/python3", *program, **{
        "ROS_MASTER_URI": f"http://{ROBOT}:11311", "ROS_IP": ADDRESSES[name], **environment})
    assert time.monotonic() - before <= 5.0
    assert not done.stderr
    found = re.findall("^FAULT +(.*)", done.stdout, re.MULTILINE)
    assert done.returncode == bool(found), done.stdout
    return found, done.stdout


@pytest.mark.parametrize("name, environment, words", [
    ("laptop", {}, "the master answers.*looked for at.*reaches this one.*agrees within"),
    ("robot", {}, "the master answers.*looked for at"),
    ("robot", {"ROS_IP": "127.0.0.1"}, "this machine keeps to itself: .* sudo ./robotont install-robot --network")])
def test_nothing_is_wrong(machines, name, environment, words):
    found, said = check(machines, name, **environment)
    assert not found, said
    assert re.search(words, said, re.DOTALL)


@pytest.mark.parametrize("environment, words", [
    ({"ROS_IP": "10.77.0.99"}, "wrong ROS_IP/ROS_HOSTNAME: ROS_IP=10.77.0.99.* export ROS_IP=10.77.0.2"),
    ({"ROS_HOSTNAME": "laptop"}, "wrong ROS_IP/ROS_HOSTNAME: the master's machine does not reach this one as 'laptop'"
     ".* export ROS_IP=10.77.0.2"),
    ({"ROS_MASTER_URI": "http://10.99.0.1:11311"}, "master unreachable: no answer from 10.99.0.1.* cable"),
    *(pytest.param(*case, marks=pytest.mark.nightly) for case in (
        ({"ROS_HOSTNAME": "localhost"}, "wrong ROS_IP/ROS_HOSTNAME: ROS_HOSTNAME=localhost.* unset ROS_HOSTNAME"),
        ({"ROS_MASTER_URI": "http://robto:11311"}, "unresolvable name: .* no address of 'robto'.* /etc/hosts"),
        ({"ROS_MASTER_URI": "robot:11311"}, "wrong ROS_MASTER_URI.* export ROS_MASTER_URI=http://"),
        ({"ROS_MASTER_URI": ""}, "master unreachable: no process listens at port 11311 of this machine itself.*: on a "
         "laptop: export ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:11311; on the robot: start the stack"),
        ({"ROS_MASTER_URI": f"http://{ROBOT}:11399"}, "master unreachable: 10.77.0.1 answers, but no process listens "
         "at port 11399.* start the robot's stack")))
])
def test_wrong_settings_on_the_laptop(machines, environment, words):
    (fault,), _ = check(machines, "laptop", **environment)
    assert re.match(words, fault)


@pytest.mark.parametrize("name, rule, words", [
    ("robot", "tcp dport 11311", f"master unreachable: no answer from 10.77.0.1 port 11311: .*firewall: {IN}"),
    ("laptop", "ct state new", "one-way traffic: this machine reaches 10.77.0.1, but not the other way round.* "
     "on this machine, sudo ufw allow from 10.77.0.1")])
def test_a_firewall_on_either_side(machines, name, rule, words):
    machines.block(name, rule)
    try:
        (fault,), _ = check(machines, "laptop")
    finally:
        machines.open_firewall(name)
    assert re.match(words, fault)
    ask = f"import xmlrpc.client; print(xmlrpc.client.ServerProxy('http://{ROBOT}:11311').getSystemState('/test'))"
    assert "robotont_network" not in machines.run("robot", "/usr/bin/python3", "-c", ask).stdout


def test_clocks_apart(machines):
    (fault,), _ = check(machines, "laptop", LATE)
    ahead = re.match("clocks apart: that of 10.77.0.1 is (.*) s ahead of this machine's.* chrony", fault)[1]
    assert float(ahead) == pytest.approx(3.0, abs=0.2)  # as exact as it promises, on a machine with much to do


PAGE = b"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n<html><p>a web page</html>"
NO_TRIPLE = (b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n<?xml version='1.0'?><methodResponse><params><param>"
             b"<value><int>1</int></value></param></params></methodResponse>")


@pytest.mark.parametrize("answer", [b"SSH-2.0-OpenSSH_9.2\r\n", PAGE, NO_TRIPLE, None],
                         ids=["SSH", "a web page", "another XML-RPC server", "nothing"])
def test_what_is_no_ros_master_is_named(answer):
    class Handler(socketserver.BaseRequestHandler):
        def handle(self):
            if answer:
                self.request.sendall(answer)
                self.request.recv(65536)  # a question that nobody reads would reset the connection
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
        words, _ = master_answers(f"http://127.0.0.1:{server.server_address[1]}")
        server.shutdown()
    assert "answers, but not as a ROS master" in words


def test_what_fails_or_takes_too_long_is_none_and_no_exit_waits_for_it():
    program = ("import time; from robotont_operations import probes; "
               "print(probes.all_in_time(lambda work: work(), [int, lambda: 1 // 0, lambda: time.sleep(60)], 1.0))")
    ended = subprocess.run([sys.executable, "-c", program], check=True, text=True, stdout=subprocess.PIPE, timeout=30)
    assert ended.stdout == "[0, None, None]\n"

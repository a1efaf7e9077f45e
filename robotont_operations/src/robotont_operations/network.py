"""./robotont network: why two machines of one ROS 1 system do not hear each other, by four questions, with the remedy.

Does the master answer? Does it know this machine's name? Can it call this machine back, as it does for every new topic?
Do the clocks agree? Each answer is one line; without a master the others have none.
"""

import argparse
import contextlib
import http.client
import os
import socket
import sys
import threading
import time
import xmlrpc.client
import xmlrpc.server
from calendar import timegm
from email.utils import parsedate
from xml.parsers.expat import ExpatError

import rosgraph.network

from robotont_operations import probes

GOOD, NOTE, FAULT = "ok", "note", "FAULT"
CALLER = "/robotont_network"  # the name of this program in its questions to the master
PATIENCE = 1.5   # [s] for the master's call
LISTENING = 1.1  # [s] to a clock that shows whole seconds
TOLERANCE = 0.2  # [s] between two clocks; tf's listeners wait about as long for a transform
QUESTION = xmlrpc.client.dumps((CALLER,), "getPid")


def master_answers(uri):
    """(what is wrong with the master at ROS_MASTER_URI, or "", its address or None)."""
    place = probes.master_place(uri)
    if place is None:
        return (f"wrong ROS_MASTER_URI: {uri!r} is no http://HOST:PORT: export "
                "ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:11311"), None
    host, port = place
    address = probes.resolve(host)
    if address is None:
        return (f"unresolvable name: this machine finds no address of {host!r} (ROS_MASTER_URI): export ROS_MASTER_URI="
                f"http://ADDRESS_OF_THE_ROBOT:{port}, or add a line 'ADDRESS {host}' to /etc/hosts"), None
    where = host if host == address else f"{host} ({address})"
    own = own_address_towards(address) or "THE_ADDRESS_OF_THIS_MACHINE"
    let_in = f"there, sudo ufw allow from {own} (ROS 1 needs all TCP ports above 1023)"
    try:
        _, _, _ = probes.ask(uri, 2.0, "getPid", CALLER)
        return "", address
    except ConnectionRefusedError:
        words = (f"no process listens at port {port} of this machine itself (ROS_MASTER_URI={uri}): on a laptop: "
                 f"export ROS_MASTER_URI=http://ADDRESS_OF_THE_ROBOT:{port}; on the robot: start the stack")
        if not address.startswith("127."):
            words = (f"{where} answers, but no process listens at port {port}, or a firewall there rejects: start the "
                     "robot's stack there; if it runs, it keeps to itself: there "
                     f"sudo ./robotont install-robot --network ADDRESS; else {let_in}")
    except (ConnectionError, http.client.HTTPException, xmlrpc.client.Error, ExpatError, TypeError, ValueError) as why:
        words = f"{where} port {port} answers, but not as a ROS master ({why}): check the port in ROS_MASTER_URI"
    except (OSError, probes.TimeoutError):
        words = (f"no answer from {where} port {port}: is it switched on, in this network, its cable in (look at 'ip "
                 f"address')? ping {address}. If that answers, its firewall: {let_in}")
    return "master unreachable: " + words, address


def knows_my_name(environment, master, announced, found):
    """(level, words): whether the address under which this machine's nodes are looked for can be right.

    announced: that address or name; found: what it is here, or None; master: the master's address.
    """
    own = own_address_towards(master)
    set_by = "ROS_HOSTNAME" if environment.get("ROS_HOSTNAME") else "ROS_IP"
    source = f"{set_by}={announced}" if environment.get(set_by) else f"ROS_IP is unset: the host name {announced!r}"
    remedy = f"export ROS_IP={own}" + ("" if set_by == "ROS_IP" else " and unset ROS_HOSTNAME")
    if is_own(master):
        remedy = "export ROS_IP=ADDRESS, that of this machine in the other's network (ip address)"
    if found is None:
        fault = f"{source} cannot be resolved even here"
    elif not is_own(found):
        fault = f"{source} ({found}) is no address of this machine"
    elif not found.startswith("127."):
        return GOOD, f"this machine's nodes are looked for at {announced}"
    elif is_own(master):
        return NOTE, (f"this machine keeps to itself: nodes of this terminal announce {announced} ({found}), which no "
                      f"other machine can use: {remedy}; for services at boot: "
                      "sudo ./robotont install-robot --network ADDRESS")
    else:
        fault = f"{source} is {found} here; if it is so for the robot, too, it finds only itself there"
    return FAULT, f"wrong ROS_IP/ROS_HOSTNAME: {fault}: {remedy}"


def calls_back(uri, master, announced):
    """(level, words): whether the master reaches this machine; a topic of its own is registered meanwhile."""
    called, own = threading.Event(), own_address_towards(master)
    topic, caller = f"{CALLER}/way_back_{os.getpid()}", f"{CALLER}_{os.getpid()}"
    with xmlrpc.server.SimpleXMLRPCServer(("0.0.0.0", 0), logRequests=False) as server:
        server.register_function(lambda *_: called.set() or (1, "", 0), "publisherUpdate")
        threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
        here = f"http://{announced}:{server.server_address[1]}/"
        try:
            for call in ("registerSubscriber", "registerPublisher"):
                probes.ask(uri, 1.0, call, caller, topic, "std_msgs/Empty", here)
            if called.wait(PATIENCE):
                return GOOD, "the master's machine reaches this one"
        except probes.RPC_ERRORS:
            return FAULT, "master unreachable: it stopped answering in mid-check: check the Wi-Fi or the cable"
        finally:
            for call in ("unregisterSubscriber", "unregisterPublisher"):
                with contextlib.suppress(*probes.RPC_ERRORS):
                    probes.ask(uri, 1.0, call, caller, topic, here)
            server.shutdown()
    if announced == own:
        return FAULT, (f"one-way traffic: this machine reaches {master}, but not the other way round (at {own}): on "
                       f"this machine, sudo ufw allow from {master}")
    return FAULT, (f"wrong ROS_IP/ROS_HOSTNAME: the master's machine does not reach this one as {announced!r}: export "
                   f"ROS_IP={own}; if that does not help, sudo ufw allow from {master}")


def clocks_agree(address, port):
    """(level, words): whether the clock of the master's machine agrees with this one's.

    Every answer of Python's HTTP server, as rosmaster has it, has a `Date` in whole seconds. A date d in an answer that
    was asked for at t0 and came at t1 bounds the difference to [d - t1, d + 1 - t0]; the second's tick makes it narrow.
    """
    low, high = float("-inf"), float("inf")
    end = time.monotonic() + LISTENING
    start = time.time() - time.monotonic()  # steady: this machine's clock may step meanwhile
    while time.monotonic() < end:
        before = time.monotonic() + start
        try:
            with contextlib.closing(http.client.HTTPConnection(address, port, timeout=1.0)) as connection:
                connection.request("POST", "/RPC2", QUESTION, {"Content-Type": "text/xml"})
                date = timegm(parsedate(connection.getresponse().getheader("Date")))
        except (OSError, http.client.HTTPException, TypeError):  # the last: it has none
            return NOTE, f"the clock of {address} does not show in its answers"
        low, high = max(low, date - time.monotonic() - start), min(high, date + 1.0 - before)
        time.sleep(0.03)
    difference, uncertainty = (low + high) / 2, abs(high - low) / 2
    if abs(difference) - uncertainty > TOLERANCE:
        return FAULT, (f"clocks apart: that of {address} is {abs(difference):.1f} s "
                       f"{'ahead of' if difference > 0 else 'behind'} this machine's: sudo apt-get install chrony on "
                       "both (without internet: docs/trouble.md)")
    return GOOD, f"the clock of {address} agrees within {max(0.01, abs(difference) + uncertainty):.2f} s"


def is_own(address):
    """Whether an IPv4 address belongs to this machine."""
    with socket.socket() as probe, contextlib.suppress(OSError):
        probe.bind((address, 0))
        return True
    return False


def own_address_towards(address):
    """Own address on the way to another one; None without a route. Sends nothing."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, contextlib.suppress(OSError):
        probe.connect((address, 9))
        return probe.getsockname()[0]
    return None


def check(environment):
    """Yield (level, words) of each question, as it is answered."""
    uri = environment.get("ROS_MASTER_URI", "").rstrip("/") or "http://localhost:11311"
    announced = environment.get("ROS_HOSTNAME") or environment.get("ROS_IP") or rosgraph.network.get_host_name()
    resolved = probes.start(probes.resolve, announced)
    trouble, master = master_answers(uri)
    yield (FAULT, trouble) if trouble else (GOOD, f"the master answers at {uri}")
    if trouble:
        return
    found = resolved.result()
    yield knows_my_name(environment, master, announced, found)
    if not is_own(master):
        if found and is_own(found) and not found.startswith("127."):
            yield calls_back(uri, master, announced)
        yield clocks_agree(master, probes.master_place(uri)[1])


def main():
    """Run the check; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="./robotont network", description="Check from this machine, robot or laptop, whether it and the ROS 1 "
        "master hear each other: address, name, way back, clocks. Takes some seconds. Run it on both machines.",
        epilog="exit status: 0 no fault; 1 at least one")
    parser.parse_args()
    status = 0
    try:
        for level, words in check(os.environ):
            print(f"{level:5}  {words}", flush=True)
            status |= level == FAULT
    except KeyboardInterrupt:
        status = 130
    except BrokenPipeError:  # | head
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(status)

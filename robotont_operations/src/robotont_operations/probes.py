"""Probes of one machine by another through sockets alone, each within a given time."""

import contextlib
import errno
import http.client
import socket
import subprocess
import threading
import time
import xml.parsers.expat
import xmlrpc.client
from calendar import timegm
from concurrent.futures import Future, wait
from email.utils import parsedate
from urllib.parse import urlsplit

OPEN, REFUSED, SILENT, NO_ROUTE = "open", "refused", "silent", "no route"  # outcomes of `reach`
OTHER_PORTS = (22, 80, 443, 9)  # asked only to see whether a host is there at all
# what calls through `remote` raise; the last two where the server speaks something else, as web and SSH servers do
RPC_ERRORS = (OSError, xmlrpc.client.Error, http.client.HTTPException, xml.parsers.expat.ExpatError)


def start(work, *arguments):
    """A Future of `work(*arguments)` in a thread for which no exit waits: a resolver takes as long as it likes."""
    future = Future()
    future.set_running_or_notify_cancel()

    def run():
        try:
            future.set_result(work(*arguments))
        except Exception as error:  # whoever asks for the result gets it
            future.set_exception(error)
    threading.Thread(target=run, daemon=True).start()
    return future


def in_time(work, timeout, *arguments):
    """(True, result) of `work(*arguments)`, or (False, None) after `timeout` [s]; it then goes on in the background.

    Passes on the exceptions of `work`.
    """
    future = start(work, *arguments)
    finished = bool(wait([future], timeout).done)
    return finished, future.result() if finished else None


def all_in_time(work, arguments, timeout):
    """[result] of `work(argument)` for each, all at once; None where it failed or took longer than `timeout` [s]."""
    futures = [start(work, argument) for argument in arguments]
    finished = wait(futures, timeout).done
    return [future.result() if future in finished and not future.exception() else None for future in futures]


def resolve(host):
    """IPv4 address, a string, of a host name; None when the name has none, or the answer takes longer than 1 s."""
    try:
        found, addresses = in_time(socket.getaddrinfo, 1.0, host, None, socket.AF_INET, socket.SOCK_STREAM)
    except (OSError, UnicodeError):
        return None
    return addresses[0][4][0] if found else None


def is_loopback(address):
    """Whether an IPv4 address means the machine itself to whoever uses it."""
    return address.startswith("127.")


def is_own(address):
    """Whether an IPv4 address belongs to this machine."""
    with socket.socket() as probe:
        try:
            probe.bind((address, 0))
        except OSError:
            return False
        return True


def own_address_towards(address):
    """Own address on the way to another one; None without a route. Sends nothing."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((address, 9))
        except OSError:
            return None
        return probe.getsockname()[0]


def reach(address, port):
    """Result of a TCP connection attempt: OPEN, REFUSED, SILENT (no answer within 1 s), or NO_ROUTE."""
    try:
        socket.create_connection((address, port), 1.0).close()
    except ConnectionRefusedError:
        return REFUSED
    except socket.timeout:
        return SILENT
    except OSError as error:
        # an absent host on the same network gives EHOSTUNREACH after a while, a rejecting firewall at once
        return NO_ROUTE if error.errno == errno.ENETUNREACH else SILENT
    return OPEN


def is_there(address):
    """Whether a host answers anything at all: a ping, or any of a few ports, be it with a refusal."""
    def asked(port):
        return ping(address) if port is None else reach(address, port) in {OPEN, REFUSED}
    return any(all_in_time(asked, (None, *OTHER_PORTS), 1.0))


def ping(address):
    """Whether a host answers an ICMP echo within 1 s; False, too, where there is no ping."""
    with contextlib.suppress(OSError):
        return not subprocess.call(["ping", "-c", "1", "-W", "1", address], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
    return False


class _Transport(xmlrpc.client.Transport):
    def __init__(self, timeout):
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host):
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


def master_place(uri):
    """(host, port) of a ROS master's URI, or None where it is no http://HOST:PORT."""
    try:
        parts = urlsplit(uri)
        place = parts.hostname, parts.port
    except ValueError:
        return None
    return place if parts.scheme == "http" and all(place) else None


def remote(uri, timeout):
    """An XML-RPC proxy each of whose answers may take `timeout` [s]; calls raise RPC_ERRORS."""
    return xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout))


_QUESTION = xmlrpc.client.dumps(("/robotont_network",), "getPid")  # which master and nodes answer without a log line


def clock_difference(address, port, duration=1.1, period=0.03):
    """(difference, uncertainty) [s] of the clock behind an HTTP server to this machine's; positive: theirs is ahead.

    Every answer of Python's HTTP server (rosmaster, rospy) has a `Date` in whole seconds. A date d in an answer asked
    for at t0 and had at t1 bounds the difference to [d - t1, d + 1 - t0]; the second's tick within `duration` [s] makes
    these bounds narrow. None where no answer has a date (roscpp's have none).
    """
    low, high = float("-inf"), float("inf")
    end = time.monotonic() + duration
    start = time.time() - time.monotonic()  # steady: this machine's clock may step meanwhile
    while time.monotonic() < end:
        before = time.monotonic() + start
        connection = http.client.HTTPConnection(address, port, timeout=max(0.1, end - time.monotonic()))
        try:
            connection.request("POST", "/RPC2", _QUESTION, {"Content-Type": "text/xml"})
            date = parsedate(connection.getresponse().getheader("Date", ""))
        except (OSError, http.client.HTTPException):
            return None
        finally:
            connection.close()
        if date is None:
            return None
        after = time.monotonic() + start
        low, high = max(low, timegm(date) - after), min(high, timegm(date) + 1.0 - before)
        time.sleep(period)
    return (low + high) / 2, abs(high - low) / 2

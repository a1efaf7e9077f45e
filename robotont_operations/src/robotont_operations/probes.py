"""Calls of other machines, each within a given time."""

import http.client
import socket
import threading
import xml.parsers.expat
import xmlrpc.client
from concurrent.futures import Future, wait
from urllib.parse import urlsplit

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

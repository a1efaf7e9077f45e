"""Calls of other machines, each within a given time."""

import contextlib
import http.client
import socket
import threading
import xml.parsers.expat
import xmlrpc.client
from concurrent.futures import Future, TimeoutError, wait
from urllib.parse import urlsplit

# what `ask` raises; the last two where the server speaks something else, as web and SSH servers do
RPC_ERRORS = (OSError, TimeoutError, xmlrpc.client.Error, http.client.HTTPException, xml.parsers.expat.ExpatError)


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


def all_in_time(work, arguments, timeout):
    """[result] of `work(argument)` for each, all at once; None where it failed or took longer than `timeout` [s]."""
    futures = [start(work, argument) for argument in arguments]
    finished = wait(futures, timeout).done
    return [future.result() if future in finished and not future.exception() else None for future in futures]


def resolve(host):
    """IPv4 address, a string, of a host name; None when the name has none, or the answer takes longer than 1 s."""
    question = start(socket.getaddrinfo, host, None, socket.AF_INET, socket.SOCK_STREAM)
    with contextlib.suppress(OSError, UnicodeError, TimeoutError):
        return question.result(1.0)[0][4][0]
    return None


def master_place(uri):
    """(host, port) of a ROS master's URI, or None where it is no http://HOST:PORT."""
    try:
        parts = urlsplit(uri)
        place = parts.hostname, parts.port
    except ValueError:
        return None
    return place if parts.scheme == "http" and all(place) else None


def ask(uri, timeout, call, *arguments):
    """(code, words, value): the answer to a call by XML-RPC to a node or master; raises RPC_ERRORS.

    A TimeoutError where it takes longer than `timeout` [s].
    """
    return start(getattr(xmlrpc.client.ServerProxy(uri), call), *arguments).result(timeout)

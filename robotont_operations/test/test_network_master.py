"""What the network check says of a port that something else than a ROS master answers at."""

import socket
import subprocess
import sys
import threading
from contextlib import contextmanager, suppress

import pytest

from robotont_operations.network import master_answers

PAGE = b"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n<html><p>a web page</html>"
NO_TRIPLE = (b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n<?xml version='1.0'?><methodResponse><params><param>"
             b"<value><int>1</int></value></param></params></methodResponse>")


@contextmanager
def server(answer):
    """URI of a server with one answer to everything; None: it closes the connection."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        def serve():
            while True:
                try:
                    connection, _ = listening.accept()
                except OSError:
                    return
                with connection, suppress(ConnectionResetError):  # by who has seen enough
                    if answer:
                        connection.sendall(answer)
                        connection.recv(65536)  # a question that nobody reads would reset the connection
        threading.Thread(target=serve, daemon=True).start()
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
        listening.shutdown(socket.SHUT_RDWR)


@pytest.mark.parametrize("answer", [b"SSH-2.0-OpenSSH_9.2\r\n", PAGE, NO_TRIPLE, b"\xff\xfe\0\0", None],
                         ids=["SSH", "a web page", "another XML-RPC server", "bytes", "nothing"])
def test_what_is_no_ros_master_is_named(answer):
    with server(answer) as uri:
        words, _ = master_answers(uri)
    assert "answers, but not as a ROS master" in words


def test_what_fails_or_takes_too_long_is_none_and_no_exit_waits_for_it():
    program = ("import time; from robotont_operations import probes; "
               "print(probes.all_in_time(lambda work: work(), [int, lambda: 1 // 0, lambda: time.sleep(60)], 1.0))")
    ended = subprocess.run([sys.executable, "-c", program], check=True, text=True, stdout=subprocess.PIPE, timeout=30)
    assert ended.stdout == "[0, None, None]\n"

"""What the network check says of a port that something else than a ROS master answers at."""

import socketserver
import subprocess
import sys
import threading
from contextlib import contextmanager

import pytest

from robotont_operations.network import master_answers

PAGE = b"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n<html><p>a web page</html>"
NO_TRIPLE = (b"HTTP/1.0 200 OK\r\nContent-Type: text/xml\r\n\r\n<?xml version='1.0'?><methodResponse><params><param>"
             b"<value><int>1</int></value></param></params></methodResponse>")


@contextmanager
def server(answer):
    """URI of a server with one answer to everything; None: it closes the connection."""
    class Handler(socketserver.BaseRequestHandler):
        def handle(self):
            if answer:
                self.request.sendall(answer)
                self.request.recv(65536)  # a question that nobody reads would reset the connection
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler) as listening:
        threading.Thread(target=listening.serve_forever, args=(0.05,), daemon=True).start()
        yield f"http://127.0.0.1:{listening.server_address[1]}"
        listening.shutdown()


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

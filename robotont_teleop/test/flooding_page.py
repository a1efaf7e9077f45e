#!/usr/bin/env python3
"""A page that sends without an end, and faster than anybody reads: flooding_page.py PORT KIND.

Ends with 0 once the server has closed it, with 1 when it has not done so within PATIENCE.
"""

import socket
import sys
import threading
import time

PATIENCE = 8.0  # [s]
AT_ONCE = 5000  # frames
MASKED = b"\x80\0\0\0\0"   # no payload; all that clients send is masked
FRAMES = {"text": b"\x81\x85\0\0\0\0hello", "part": b"\x00" + MASKED}  # of a message that does not end
FIRST_PART = b"\x01" + MASKED


def open_socket(port):
    """A connection that has asked to be a page's."""
    connection = socket.create_connection(("127.0.0.1", port))
    host = f"127.0.0.1:{port}"
    connection.sendall((f"GET /socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nUpgrade: websocket\r\n"
                        "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n").encode())
    return connection


def read_all(connection):
    """So that the server cannot end it as one that does not read."""
    try:
        while connection.recv(1 << 16):
            pass
    except OSError:
        pass


def main():
    """Flood."""
    connection = open_socket(int(sys.argv[1]))
    kind = sys.argv[2]
    connection.recv(1000)  # it is open
    threading.Thread(target=read_all, args=[connection], daemon=True).start()
    print("flooding", flush=True)
    frames = FRAMES[kind] * AT_ONCE
    end = time.monotonic() + PATIENCE
    try:
        if kind == "part":
            connection.sendall(FIRST_PART)
        while time.monotonic() < end:
            connection.settimeout(max(0.001, end - time.monotonic()))
            connection.sendall(frames)
    except socket.timeout:
        pass
    except OSError:
        sys.exit(0)
    sys.exit(1)


if __name__ == "__main__":
    main()

"""A TCP proxy whose connections can be cut, and stalled without losing a byte."""

import contextlib
import select
import socket
import threading


class StallingProxy:
    """Forwards `port` to `target_port` of 127.0.0.1. Directions: "up" from the client, "down" to it.

    room: [bytes] that it holds at each end; 0: as much as the system likes, which are megabytes.
    """

    def __init__(self, target_port, room=0):
        self._room = room
        self._target = target_port
        self._flows = {"up": threading.Event(), "down": threading.Event()}
        self.flow()
        self._sockets = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def stall(self, *directions):
        """Forward nothing any more; incoming data waits."""
        for direction in directions or self._flows:
            self._flows[direction].clear()

    def flow(self):
        """Forward the waiting data, and go on."""
        for event in self._flows.values():
            event.set()

    def cut(self):
        """End all connections."""
        for end in self._sockets:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
        self._sockets.clear()

    def close(self):
        """End all connections, and accept no more."""
        with contextlib.suppress(OSError):  # closed before
            self._listener.shutdown(socket.SHUT_RDWR)  # else an accept that waits takes one more
        self._listener.close()
        self.flow()
        self.cut()

    def _accept(self):
        while True:
            try:
                client, _ = self._listener.accept()
                server = socket.create_connection(("127.0.0.1", self._target))
            except OSError:
                if self._listener.fileno() == -1:
                    return
                client.close()  # the server is away
                continue
            for end in (client, server):
                for buffer in (socket.SO_SNDBUF, socket.SO_RCVBUF) if self._room else ():
                    end.setsockopt(socket.SOL_SOCKET, buffer, self._room)
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._sockets += [client, server]
            for source, sink, direction in ((client, server, "up"), (server, client, "down")):
                threading.Thread(target=self._forward, args=(source, sink, self._flows[direction]), daemon=True).start()

    @staticmethod
    def _forward(source, sink, flow):
        with contextlib.suppress(OSError, ValueError):
            while True:
                select.select([source], [], [])
                data = source.recv(65536)
                flow.wait()
                if not data:
                    break
                sink.sendall(data)
        for end in (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

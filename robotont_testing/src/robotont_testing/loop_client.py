"""Requests and coroutines of a test, in an asyncio loop of its own thread."""

import asyncio
import contextlib
import http.client
import threading

PATIENCE = 20.0  # [s]


class LoopClient:
    """The loop, for a `with` block; `port`: of a server on this computer."""

    def __init__(self, port=None):
        self.port = port
        self.loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self.loop.run_forever, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self.loop.call_soon_threadsafe(self.loop.stop)
        self._thread.join()

    def do(self, coroutine):
        """The result of a coroutine in the loop."""
        return asyncio.run_coroutine_threadsafe(coroutine, self.loop).result(PATIENCE)

    def request(self, method, path, body=None, **headers):
        """(status, headers, body) of a request; header names with _ for -."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        with contextlib.closing(connection):
            connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()

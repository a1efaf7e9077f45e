"""What the servers of a robot's page and of a fleet's have in common: doors, files, limits."""

import asyncio

import tornado.httpserver
import tornado.log
import tornado.netutil
import tornado.web

from robotont_teleop.web.page_setup import SetUpError, make_tls, page_url
from robotont_teleop.web.web_handlers import FileHandler, LoginHandler, MapHandler, MetricsHandler

MAX_CONNECTIONS = 64  # open at once, pages among them
LARGEST_BODY, LARGEST_HEADER = 1024, 8192  # [bytes] of a request
IDLE, BODY_TIMEOUT = 20.0, 5.0  # [s] an HTTP connection may be idle, a body may take


class PageServer:
    """access: `Access`. names: host names under which browsers may come. files: as of `read_files`.

    Subclasses have `map_picture`, a PNG or None, and `metrics()`, text for Prometheus.
    """

    def __init__(self, access, names, files):
        self.access, self.names, self.files = access, names, files
        self._loop = asyncio.get_running_loop()

    def serve(self, handlers, address, port, certificate="", **options):
        """Serve by further tornado handlers; returns the page's URL. Port 0: any. Raises SetUpError."""
        tornado.log.gen_log.setLevel("ERROR")  # not a line for each request of a stranger that is none
        tls = make_tls(certificate)
        self.scheme = "https" if tls else "http"
        try:
            sockets = tornado.netutil.bind_sockets(port, address)
        except OSError as error:
            raise SetUpError(f"port {port} of {address}: {error.strerror or error}; choose another one") from None
        application = tornado.web.Application(
            [*handlers, (r"/login", LoginHandler), (r"/map\.png", MapHandler), (r"/metrics", MetricsHandler),
             (r"/(.*)", FileHandler)], log_function=lambda handler: None, **options)
        application.web_server = self
        self.http_server = LimitedServer(
            application, ssl_options=tls, max_header_size=LARGEST_HEADER, max_body_size=LARGEST_BODY,
            max_buffer_size=8 * LARGEST_HEADER, idle_connection_timeout=IDLE, body_timeout=BODY_TIMEOUT)
        self.http_server.add_sockets(sockets)
        self.port = sockets[0].getsockname()[1]
        return page_url(address, self.port, tls)


class LimitedServer(tornado.httpserver.HTTPServer):
    """Beyond the limit closes the oldest connection on which nobody has shown that he may come in: maybe the new one.

    So strangers can take the connections from each other only. `admitted` of a stream: who may come in has asked on it.
    """

    _streams = ()

    def handle_stream(self, stream, address):
        """Called by tornado for a new connection."""
        stream.admitted = False
        self._streams = [one for one in (*self._streams, stream) if not one.closed()]
        if len(self._streams) > MAX_CONNECTIONS:
            next(one for one in self._streams if not one.admitted).close()
        if not stream.closed():
            super().handle_stream(stream, address)

"""Names and address of this computer, for a page that it serves."""

import socket


def host_names(given):
    """Names under which browsers may come: those given, separated by commas, and this computer's."""
    own = socket.gethostname().lower()
    names = {own, own.partition(".")[0] + ".local", *(name.strip().lower() for name in given.split(","))}
    return tuple(sorted(names - {""}))


def own_address():
    """Address of this computer in the network, to show it; its name where there is no network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing
            return probe.getsockname()[0]
        except OSError:
            return socket.gethostname()

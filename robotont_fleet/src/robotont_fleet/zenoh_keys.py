"""Names under which robots of a fleet talk to each other over zenoh; free of network."""

import re

TEACHER = "teacher"  # the user whose orders robots obey; nobody's name
OWN = "robotont"  # beginning of all keys


def check_name(name):
    """The name of a robot, which is a part of its keys. Raises ValueError."""
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,40}", name) or name.lower() == TEACHER:
        raise ValueError(f"name of a robot: found {name!r}, allowed: up to 41 letters, "
                         f"digits and _ . -, the first no sign; not {TEACHER}")
    return name


def check_router(endpoint):
    """Where a robot finds the fleet's router, as zenoh writes it. Raises ValueError."""
    if not re.fullmatch(r"(tcp|tls|quic|udp|ws)/\S+:\d+\S*", endpoint):
        raise ValueError(f"~router: found {endpoint!r}, allowed: tcp/ADDRESS:7447, as zenoh writes it")


def state_key(robot="*"):
    """What the robot says of itself, as JSON, twice a second, and behind an order or a press of a stop."""
    return f"{OWN}/{robot}/state"


def order_key(robot):
    """Orders to it, as JSON: stop, release, cancel, goal."""
    return f"{OWN}/{robot}/order"


def alive_key(robot="*", identity="*"):
    """Liveliness token of a process of a robot."""
    return f"{OWN}/{robot}/alive/{identity}"


def parts_of(key):
    """[robot, what, ...] of one of our own keys."""
    return str(key).split("/")[1:]

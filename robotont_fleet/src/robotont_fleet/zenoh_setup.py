"""Eclipse zenoh: how robots and the router are set up, and what is said where it is not installed."""

import contextlib
import json
import os
import secrets
from pathlib import Path

from robotont_driver.parameters.files import alone_in, read_file, write_file
from robotont_fleet.zenoh_keys import OWN, TEACHER, check_name
from robotont_teleop.web.access import read_or_make_token

try:
    import zenoh
except ImportError:  # the robot drives without it
    zenoh = None

ABSENT = ("no zenoh, which only the fleet needs: ./robotont setup fleet, and, where it starts at boot, install-robot "
          "anew; in a catkin workspace docs/fleet.md")
LEASE = 2000          # [ms] a connection that is silent for so long is closed, with all that waits in it
LARGEST_FILE = 100_000  # [bytes] of passwords
RETRY = 100           # [ms] between two attempts to connect
JAM = 1000000         # [us] that a message waits for room on a connection, which is closed after it, and made anew
MESSAGES = ("put", "delete", "declare_subscriber", "query", "declare_queryable", "reply", "liveliness_token",
            "declare_liveliness_subscriber", "liveliness_query")
LARGEST = 1 << 20     # [bytes] of a message
ROOM = 1 << 16        # [bytes] that wait in a connection: behind more a stop would wait for seconds
COMMON = {"transport/link/rx/max_message_size": LARGEST,
          **{f"transport/link/tcp/so_{way}buf": ROOM for way in ("snd", "rcv")},
          "scouting/multicast/enabled": False, "scouting/gossip/enabled": False, "transport/link/tx/lease": LEASE,
          "transport/link/tx/queue/congestion_control/block/wait_before_close": JAM}


def client_settings(router, user="", password=""):
    """Settings of a robot: it reconnects for ever, and keeps nothing meanwhile.

    Without classes of priority all that comes over a connection comes in the order in which the router has sent it.
    """
    settings = {**COMMON, "mode": "client", "connect/endpoints": [router], "connect/timeout_ms": -1,
                "connect/exit_on_failure": False, "connect/retry": {"period_init_ms": RETRY, "period_max_ms": RETRY},
                "transport/unicast/qos/enabled": False}
    return {**settings, **_login(user, password)} if password else settings


def router_settings(port, users_file=None):
    """Settings of a router on this computer, for who is in a `users_file`; without one for this computer only.

    Each robot may use its own keys only; without a file anybody all keys. Raises ValueError, OSError where the file
    cannot be used, or lacks the page itself.
    """
    address = "0.0.0.0" if users_file else "127.0.0.1"
    settings = {**COMMON, "mode": "router", "listen/endpoints": [f"tcp/{address}:{port}"]}
    if not users_file:
        return settings
    users = read_users(users_file)
    if TEACHER not in users:
        raise ValueError(f"{users_file}: found no password of the page ({TEACHER}), allowed: what "
                         "./robotont fleet --add ROBOT ... makes")
    keys = {name: ["**"] if name == TEACHER else [f"{OWN}/{name}/**"] for name in users}
    access = {"enabled": True, "default_permission": "deny",
              "rules": [{"id": name, "permission": "allow", "messages": list(MESSAGES),
                         "flows": ["ingress", "egress"], "key_exprs": keys[name]} for name in users],
              "subjects": [{"id": name, "usernames": [name]} for name in users],
              "policies": [{"rules": [name], "subjects": [name]} for name in users]}
    return {**settings, **_login(TEACHER, users[TEACHER]), "transport/auth/usrpwd/dictionary_file": str(users_file),
            "access_control": access}


def _login(user, password):
    return {"transport/auth/usrpwd/user": user, "transport/auth/usrpwd/password": password}


def open_session(settings):
    """A zenoh session. Raises zenoh.ZError."""
    config = zenoh.Config()
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def send(session, key, payload):
    """Put a message; without a connection it is dropped.

    Not by CongestionControl.DROP: without classes of priority zenoh 1.10 drops all that comes after the first such
    message that has found no room, until the connection ends.
    """
    with contextlib.suppress(zenoh.ZError):  # closed, at the end of this process
        session.put(key, payload, congestion_control=zenoh.CongestionControl.BLOCK, express=True)


def read_password(path):
    """The password in a file that only its owner reads; "" where there is no file. Raises ValueError, OSError."""
    if Path(path).exists() and not Path(path).stat().st_size:
        raise ValueError(f"{path}: empty, allowed: the password that ./robotont fleet --add has printed")
    return read_or_make_token(path, "write into it what ./robotont fleet --add prints") if Path(path).exists() else ""


def read_users(path):
    """{name: password}, as zenoh's dictionary_file holds it; raises OSError, ValueError."""
    text = read_file(path, LARGEST_FILE).decode("utf-8", "replace") if os.path.lexists(path) else ""
    if text and Path(path).stat().st_mode & 0o077:
        raise ValueError(f"{path}: others may read the passwords, allowed: mode 600")
    for number, line in enumerate(text.split(), 1):
        if ":" not in line:
            raise ValueError(f"{path}: found no colon in line {number}, allowed: NAME:PASSWORD")
    return dict(line.split(":", 1) for line in text.split())


def add_users(path, names):
    """{name: password} with a new password for each name that has none yet, and for the teacher."""
    with alone_in(Path(path).parent):
        users = read_users(path)
        for name in (*map(check_name, names), TEACHER):
            users.setdefault(name, secrets.token_urlsafe(16))
        write_file(path, "".join(f"{name}:{password}\n" for name, password in users.items()), 0o600)
    return users

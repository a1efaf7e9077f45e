"""Who may open the page: token, cookie, Host and Origin; free of network and clock."""

import hashlib
import hmac
import ipaddress
import re
import secrets
from pathlib import Path

from robotont_driver.parameters.files import alone_in, read_file, write_file

TOKEN = re.compile("[!-~]{16,128}")  # nobody guesses such a one over a network, so wrong ones need no limit
LARGEST_FILE = 10_000  # [bytes] of a token
HOST = re.compile(r"(?:\[([0-9a-f:.]+)\]|([\w.-]+))(?::[0-9]*)?")  # a header's, with or without a port


def read_or_make_token(path, remedy="delete the file to get a new token"):
    """The token in a file, which is made with mode 0600 where there is none, or an empty one.

    Raises OSError, or ValueError when others may read the file or it holds no token, for which there is a remedy.
    """
    path = Path(path)
    with alone_in(path.parent):  # of two that start at once the second reads what the first has made
        if not path.exists() or not path.stat().st_size:
            write_file(path, secrets.token_urlsafe(16) + "\n", 0o600)
    mode = path.stat().st_mode & 0o777
    if mode & 0o077:
        raise ValueError(f"{path}: found mode {mode:o}, allowed: 600 (others could read it)")
    token = read_file(path, LARGEST_FILE).decode("utf-8", "replace").strip()
    if not TOKEN.fullmatch(token):  # zeros, as after a loss of power
        raise ValueError(f"{path}: found {len(token)} characters, allowed: 16 to 128 of ASCII without "
                         f"blanks; {remedy}")
    return token


class Access:
    """Decides by token and cookie. `token`: None lets everybody in (for 127.0.0.1 only).

    cookie_name: one of each page's own, for a computer's ports share their cookies. file: that of the token.
    """

    def __init__(self, token, cookie_name="robotont_teleop", file=None):
        self.token, self.cookie_name, self.file = token, cookie_name, file

    @property
    def cookie(self):
        """Value that a browser keeps once it has shown the token; the token cannot be derived from it."""
        message = f"{self.cookie_name} cookie".encode()
        return hmac.new((self.token or "").encode(), message, hashlib.sha256).hexdigest()

    def admits(self, cookie):
        """Whether a browser with this cookie (a string, or None) may come in."""
        return self.token is None or _same(cookie or "", self.cookie)

    def knows(self, token):
        """Whether this is the token."""
        return self.token is not None and _same(token, self.token)


def _same(one, other):
    """Whether two strings are equal, in a time that does not depend on where they differ."""
    return hmac.compare_digest(one.encode("utf-8", "replace"), other.encode("utf-8", "replace"))


def host_allowed(host, own_address, names):
    """Whether a Host header names this server: by the address that the connection came to, or by one of its `names`.

    A foreign name there means that a foreign DNS server leads browsers here (DNS rebinding). The port does not matter:
    a tunnel may change it.
    """
    found = HOST.fullmatch((host or "").lower())
    name = found and (found[1] or found[2])  # browsers write each address in one way, as sockets do
    own = own_address.partition("%")[0].rpartition("::ffff:")[2]
    return bool(name) and (name == own or name in names or (is_loopback(name) and is_loopback(own)))


def origin_allowed(origin, scheme, host):
    """Whether an Origin header (None when there is none) is that of the page which this Host serves."""
    return bool(origin) and bool(host) and origin.lower() == f"{scheme}://{host}".lower()


def is_loopback(address):
    """Whether a server at this address, or of this name, can be reached from this computer only."""
    try:
        return ipaddress.ip_address(address.partition("%")[0]).is_loopback
    except ValueError:
        return address == "localhost"

"""Who may open a page that this computer serves, under which address, and how people are told."""

import contextlib
import io
import os
import socket
import ssl
import subprocess
import sys
import threading
from pathlib import Path

from robotont_teleop.web.access import Access, is_loopback, read_or_make_token

LIGHT_ON_BLACK, RESET = "\x1b[97;40m", "\x1b[0m"  # of a terminal (ECMA-48)


class SetUpError(Exception):
    """The page cannot be served; states the found and the allowed values."""


def ros_home():
    """Folder for the files of this user."""
    return Path(os.environ.get("ROS_HOME") or Path.home() / ".ros")


def make_access(address, file, cookie_name):
    """Access: by a token in a `file` only where others than this computer can connect. Raises SetUpError."""
    if is_loopback(address):
        return Access(None, cookie_name)
    try:
        return Access(read_or_make_token(file), cookie_name, file)
    except (OSError, ValueError) as error:
        raise SetUpError(f"the token's file: {error}") from None


def make_tls(certificate):
    """ssl.SSLContext, or None without a certificate. Raises SetUpError."""
    if not certificate:
        return None
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    try:
        context.load_cert_chain(certificate, password=_refuse_password)
    except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
        raise SetUpError(f"certificate {certificate}: {error}") from None
    return context


def _refuse_password():
    """Called for an encrypted key; else OpenSSL would ask for it on the terminal, and wait."""
    raise ValueError("the key is encrypted; allowed: one without a password (openssl pkey -in KEY -out PLAIN_KEY)")


def host_names(given):
    """Set of the names under which browsers may come: those given, separated by commas, and this computer's.

    Its full name comes later, for it has to be asked for in the network.
    """
    own = socket.gethostname().lower()
    short = own.partition(".")[0]
    names = {own, short, short + ".local", *(name.strip().lower() for name in given.split(","))} - {""}
    threading.Thread(target=lambda: names.add(socket.getfqdn().lower()), daemon=True).start()
    return names


def own_address():
    """Address of this computer in the network, to show it; its name where there is no network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing
            return probe.getsockname()[0]
        except OSError:  # no default route, as on a robot's own access point
            with contextlib.suppress(OSError, IndexError):
                told = subprocess.run(["hostname", "-I"], stdout=subprocess.PIPE, text=True, check=False)
                return told.stdout.split()[0]
            return socket.gethostname()


def page_url(address, port, tls):
    """Under which address a page that is served at `address` is opened, from other computers where they may."""
    shown = own_address() if address in ("", "0.0.0.0", "::") else address
    return f"{'https' if tls else 'http'}://{f'[{shown}]' if ':' in shown else shown}:{port}/"


def invitation(url, access, terminal):
    """Lines that tell how to get in where a token is asked for.

    The token and its QR code for a terminal only, light on black whatever its colours are: all else may be a log that
    others read. Those are told the token's file.
    """
    if access.token is None:
        return []
    if not terminal:
        return [f"token, asked for once: cat {access.file} (sudo cat, if another user's)"]
    sys.stdout.reconfigure(errors="replace")  # a terminal without UTF-8 shows the token alone
    import qrcode  # here: of 4.5 MiB, which fleet_node does not need
    code = qrcode.QRCode(border=2)
    code.add_data(f"{url}#token={access.token}")  # the part after # is sent to no server and written to no log
    picture = io.StringIO()
    code.print_ascii(picture, invert=True)
    rows = [LIGHT_ON_BLACK + row + RESET for row in picture.getvalue().replace("\xa0", " ").splitlines() if row]
    return ["", *rows, "", f"token, asked for once: {access.token}"]

"""Which version of this stack a process runs: an older one than its clone's, until it is started again."""

import contextlib
import re
from pathlib import Path

CLONE = Path(__file__).resolve().parents[4]


def version(clone=CLONE):
    """The packages' version and, where git has noted its way, the commit: "1.0.0 (12ab34cd)"."""
    words = ""
    with contextlib.suppress(OSError, IndexError):
        words = re.search("<version>(.*)<", (clone / "robotont_driver/package.xml").read_text()).group(1)
        # git itself refuses a clone of another user, as that of the services is
        words += " ({:.8})".format((clone / ".git/logs/HEAD").read_text().splitlines()[-1].split()[1])
    return words

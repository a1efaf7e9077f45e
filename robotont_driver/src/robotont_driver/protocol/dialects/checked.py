"""Packets with a CRC, a counter and encoder totals behind the semicolon; see docs/protocol.md."""

from robotont_driver.protocol.dialects.plain import Plain


class Checked(Plain):
    """Only packets with a valid trailer are read, and commands carry a CRC."""

    name = "checked"

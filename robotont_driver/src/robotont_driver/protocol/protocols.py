"""Protocols: the serial protocols of the boards of Robotont, each a pure module behind the same small interface.

protocol: the interface. thesis_firmware: plain; own_firmware: checked. robotont2, robotont3: the official firmware of
each generation. recognition: identifies the protocol from the board's output. See docs/protocols.md
"""

from robotont_driver.protocol.board_wheels import DISTANCE
from robotont_driver.protocol.checked import Checked
from robotont_driver.protocol.handshake import Handshake
from robotont_driver.protocol.plain import Plain
from robotont_driver.protocol.robotont2 import Robotont2
from robotont_driver.protocol.robotont3 import Robotont3

AUTO = "auto"
NAMES = (AUTO, Plain.name, Checked.name, Robotont2.name, Robotont3.name)
OFFICIAL = (Robotont2.name, Robotont3.name)  # their boards tell at once who they are


def expect_protocol(name, wheels, board_distance=DISTANCE):
    """As `make_protocol`, for a board that has to show by its lines that it speaks the official protocol of that name."""
    if name not in OFFICIAL:
        return make_protocol(name, wheels, board_distance)
    return Handshake(wheels, lambda found: make_protocol(found, wheels, board_distance), name)


def make_protocol(name, wheels, board_distance=DISTANCE):
    """The protocol of a name out of NAMES for `Wheels`. Raises ProtocolError when its board cannot have such wheels.

    board_distance: [m] from centre to wheel, as the official firmware assumes it.
    """
    if name == AUTO:
        return Handshake(wheels, lambda found: make_protocol(found, wheels, board_distance))
    if name in (Robotont2.name, Robotont3.name):
        return (Robotont2 if name == Robotont2.name else Robotont3)(wheels, board_distance)
    return {kind.name: kind for kind in (Plain, Checked)}[name](wheels)

"""Dialects: the serial protocols of the boards of Robotont, each a pure module behind the same small interface.

dialect: the interface. thesis_firmware: plain; own_firmware: checked. robotont2, robotont3: the official firmware of
each generation. recognition: identifies the dialect from the board's output. See docs/dialects.md
"""

from robotont_driver.protocol.dialects.board_wheels import DISTANCE
from robotont_driver.protocol.dialects.own_firmware import Checked
from robotont_driver.protocol.dialects.recognition import Recognised
from robotont_driver.protocol.dialects.robotont2 import Robotont2
from robotont_driver.protocol.dialects.robotont3 import Robotont3
from robotont_driver.protocol.dialects.thesis_firmware import Plain

AUTO = "auto"
NAMES = (AUTO, Plain.name, Checked.name, Robotont2.name, Robotont3.name)
OFFICIAL = (Robotont2.name, Robotont3.name)  # their boards tell at once who they are


def expect_dialect(name, wheels, board_distance=DISTANCE):
    """As `make_dialect`, for a board that has to show by its lines that it is of the official dialect of that name."""
    if name not in OFFICIAL:
        return make_dialect(name, wheels, board_distance)
    return Recognised(wheels, lambda found: make_dialect(found, wheels, board_distance), name)


def make_dialect(name, wheels, board_distance=DISTANCE):
    """The dialect of a name out of NAMES for `Wheels`. Raises DialectError when its board cannot have such wheels.

    board_distance: [m] from centre to wheel, as the official firmware assumes it.
    """
    if name == AUTO:
        return Recognised(wheels, lambda found: make_dialect(found, wheels, board_distance))
    if name in (Robotont2.name, Robotont3.name):
        return (Robotont2 if name == Robotont2.name else Robotont3)(wheels, board_distance)
    return {kind.name: kind for kind in (Plain, Checked)}[name](wheels)

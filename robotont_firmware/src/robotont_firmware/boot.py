"""First thing after a reset: motors off, whatever comes next. Needs no other file.

`./robotont flash` puts the wiring profile's pins here; a test compares them with the profile.
"""

import micropython
import pyb

MOTOR_PINS = ("PC6", "PC7", "PC8", "PB8", "PB9", "PB12", "PB13", "PB14", "PB15")

micropython.kbd_intr(-1)  # a 0x03 from the PC must not park the board in the REPL
for _pin in MOTOR_PINS:
    pyb.Pin(_pin, pyb.Pin.OUT_PP, value=0)

"""Why the board starts, and what one start tells the next; registers of the chip."""

import machine

# A note to the next start, in a backup register of the real-time clock: it outlives every reset but a power
# cut, costs no file system, and MicroPython itself uses none of these registers.
_NOTE = 0x400028CC  # RTC_BKP31R
REPL_WISHED = 0x524F4231
CRASHED = 0x524F4232
_STARTS = 0x400028C8  # RTC_BKP30R: how many starts in a row have ended before they lasted
IN_VAIN = 3  # such starts; the next one leaves the REPL free


def take_note():
    """Return the note that the last run left for this start, and forget it."""
    note = machine.mem32[_NOTE]
    machine.mem32[_NOTE] = 0
    return note & 0xFFFFFFFF


def leave_note(note):
    """Leave REPL_WISHED or CRASHED for the next start."""
    machine.mem32[_NOTE] = note


def starts_in_vain(cause):
    """Return how many starts in a row have ended at once by a crash or the watchdog; `cause` of this one."""
    if cause not in ("crash", "watchdog"):
        machine.mem32[_STARTS] = 0
    return machine.mem32[_STARTS]


def forget_starts():
    """Let the next start try again."""
    machine.mem32[_STARTS] = 0


def begin():
    """Count this start among those that have not lasted yet."""
    machine.mem32[_STARTS] += 1


def restart_into_repl():
    """Reset the board, which then stays in the REPL: the watchdog allows no REPL without a reset."""
    leave_note(REPL_WISHED)
    machine.reset()


def reset_cause(note):
    """Return why the board started, in one word; `note` is what take_note returned.

    A reset by software looks like the reset button to the chip.
    """
    if note == CRASHED:
        return "crash"
    causes = {
        machine.PWRON_RESET: "power",
        machine.HARD_RESET: "button",
        machine.WDT_RESET: "watchdog",
        machine.SOFT_RESET: "soft",
    }
    return causes.get(machine.reset_cause(), "other")

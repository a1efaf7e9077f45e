"""Starts the firmware, or leaves the REPL free in safe mode (USER held, or the PC asked for it)."""

import machine
import micropython


def main():
    """Run until the PC asks for the REPL; however it ends, the motors are off and the heap is free."""
    from robotont_firmware import board, config
    from robotont_firmware.main_loop import Controller
    from robotont_firmware.protocol import line_of

    cause = board.start_cause(config)
    if cause == "repl":
        print("# robotont_firmware safe mode: the REPL is free")
        return
    hardware = board.Board(config)
    controller = Controller(hardware, config, reset_cause=cause)
    hardware.start(controller)  # the REPL is off, the watchdog armed: from here on every error ends in a reset
    note, words = board.REPL_WISHED, "# repl"
    try:
        micropython.heap_lock()
        try:
            controller.run()
        finally:
            micropython.heap_unlock()
    except Exception as error:
        # The watchdog is no longer fed: it resets the board, and the firmware starts again, and waits for
        # a command of zeros.
        note, words = board.CRASHED, f"# crash {error!r}"
        raise
    finally:
        hardware.stop()
        machine.mem32[board.NOTE] = note
        line = line_of(words)
        hardware.write(line, len(line))
    machine.reset()  # the watchdog allows no REPL without it


micropython.kbd_intr(-1)  # MicroPython allows Ctrl-C again for every file that it runs
micropython.alloc_emergency_exception_buf(100)  # so that an error in the tick's interrupt can be reported
try:
    main()
finally:  # an error before the watchdog is armed ends in the REPL, with its message on the screen
    micropython.kbd_intr(3)  # Ctrl-C

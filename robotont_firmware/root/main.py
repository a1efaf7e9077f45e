"""Starts the firmware, or leaves the REPL free in safe mode (USER held, or the PC asked for it)."""

import micropython

from robotont_firmware import board, config
from robotont_firmware.controller import Controller


def main():
    """Run until the PC asks for the REPL; however it ends, the motors are off and the heap is free."""
    if board.wants_safe_mode(config):
        print("# robotont_firmware safe mode: the REPL is free")
        return
    cause = board.reset_cause()
    hardware = board.Board(config)
    try:
        controller = Controller(hardware, config, reset_cause=cause)
        controller.start()
        micropython.heap_lock()
        try:
            wants_repl = controller.run()
        finally:
            micropython.heap_unlock()
        if wants_repl:
            hardware.write("# repl\n", 7)
            board.restart_into_repl()
    except Exception as error:
        # Nobody feeds the watchdog now: it resets the board and the firmware starts again.
        line = f"# crash {error!r}\n"
        hardware.write(line, len(line))
        raise
    finally:
        hardware.stop()


micropython.alloc_emergency_exception_buf(100)  # so that an error in the tick's interrupt can be told
main()

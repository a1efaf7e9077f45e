"""MicroPython's names for compiling to machine code, and their replacements on CPython.

`@micropython.native` and `@micropython.viper` compile a function when it is loaded; viper's integers are
machine words and `ptr8`, `ptr16`, `ptr32` reach into a buffer directly. On CPython they all do nothing.
"""

import sys

try:
    from time import ticks_cpu, ticks_diff

    import micropython
except ImportError:

    class micropython:  # noqa: N801 (it stands for the module)
        """CPython's stand-in."""

        @staticmethod
        def const(value):
            """Return `value`."""
            return value

        @staticmethod
        def native(function):
            """Return the function as it is."""
            return function

        viper = native

    def ptr8(numbers):
        """Return the buffer or array: indexing it reaches its numbers."""
        return numbers

    ptr16 = ptr32 = ptr8
    SIGN = 0

    def ticks_cpu():
        """Return the processor's cycles, modulo a power of 2: none here."""
        return 0

    def ticks_diff(now, before):
        """Return the difference of two such numbers."""
        return now - before

else:
    ptr8 = ptr16 = ptr32 = None  # viper recognises them by name
    SIGN = 32 if sys.maxsize >> 31 else 0  # ptr32 reads no sign: `n[0] << SIGN >> SIGN` has it on every processor

const = micropython.const

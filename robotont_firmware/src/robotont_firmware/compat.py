"""MicroPython's names for compiling to machine code, and their replacements on CPython.

`@micropython.native` and `@micropython.viper` compile a function when it is loaded; viper's integers are
machine words and `ptr8`, `ptr16`, `ptr32` reach into a buffer directly. On CPython they all do nothing.
"""

import sys

try:
    import micropython
except ImportError:
    from types import SimpleNamespace

    def same(value):
        """Return it."""
        return value

    micropython = SimpleNamespace(const=same, native=same, viper=same)
    ptr8 = ptr16 = ptr32 = same
    SIGN = 0
else:
    ptr8 = ptr16 = ptr32 = None  # viper recognises them by name
    SIGN = 32 if sys.maxsize >> 31 else 0  # ptr32 reads no sign: `n[0] << SIGN >> SIGN` has it on every processor

const = micropython.const

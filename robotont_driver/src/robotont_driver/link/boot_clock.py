"""The clock by which ages are told: steady, and it goes on while the machine is suspended."""

import functools
import time

boot_time = functools.partial(time.clock_gettime, time.CLOCK_BOOTTIME)  # [s]; time.monotonic() stands in suspend

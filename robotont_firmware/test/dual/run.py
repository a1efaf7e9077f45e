"""Run the suites on the interpreter that runs this file: `run.py SRC GOLDEN SUITE...`.

Prints one line per test, `ok NAME` or `FAIL NAME reason`, and what a test returns as `value NAME ...`.
"""

import gc
import sys

sys.path.insert(0, sys.argv[1])
sys.path.insert(0, __file__.rsplit("/", 1)[0] if "/" in __file__ else ".")

import dual_tools
import lifted  # noqa: F401

dual_tools.GOLDEN_PATH = sys.argv[2]


def run(suite):
    """Run every function of the module whose name starts with test_."""
    failed = 0
    module = __import__(suite)
    for name in sorted(dir(module)):
        if name.startswith("test_"):
            full = suite + "." + name
            gc.collect()  # the board's heap is small
            try:
                value = getattr(module, name)()
            except Exception as error:
                failed += 1
                print("FAIL", full, repr(error))
                if hasattr(sys, "print_exception"):
                    sys.print_exception(error)
                else:
                    import traceback

                    traceback.print_exc(file=sys.stdout)
            else:
                print("ok", full)
                if value is not None:
                    print("value", full, value)
    return failed


sys.exit(1 if sum([run(suite) for suite in sys.argv[3:]]) else 0)

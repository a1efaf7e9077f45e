import sys
import time

from robotont_testing.witness import Witness


def test_what_holds_up_every_thread_is_noticed():
    interval = sys.getswitchinterval()
    with Witness() as witness:
        time.sleep(0.05)
        sys.setswitchinterval(10.0)  # from now on this thread keeps the interpreter for itself
        begin = time.monotonic()
        while time.monotonic() < begin + 0.3:
            pass
        sys.setswitchinterval(interval)
        end = time.monotonic()
        assert witness.longest_gap(begin, end) > 0.2
        assert witness.longest_gap(begin + 0.1, begin + 0.2) < 0.11, "only the part within these times"
        assert witness.longest_gap(begin - 20.0, begin - 10.0) == 0.0

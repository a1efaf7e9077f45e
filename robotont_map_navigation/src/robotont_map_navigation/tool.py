"""How goto and relocalize begin, wait and end: a line of words, and an exit status."""

import sys
import time

from robotont_driver.rospy_repairs.rospy_process import NoMasterError, init_tool
from robotont_map_navigation.goal import Outcome, Status


def run_tool(name, work):
    """Make this process the node `name`, print the words of the Outcome of `work()`, and exit with its status."""
    try:
        init_tool(name)
        end = work()
    except NoMasterError as error:
        end = Outcome(Status.NOT_THERE, str(error))
    except KeyboardInterrupt:
        end = Outcome(Status.INTERRUPTED, "interrupted")
    print(end.words, file=sys.stdout if end.status == Status.DONE else sys.stderr, flush=True)
    sys.exit(end.status)


def wait_for(condition, timeout):
    """Whether `condition()` becomes true within `timeout` [s]."""
    end = time.monotonic() + timeout
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    return bool(condition())

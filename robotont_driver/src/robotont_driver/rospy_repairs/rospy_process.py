"""A rospy process: it begins with a master or words, ends soon whatever hangs, and waits for no reader of its log."""

import atexit
import contextlib
import faulthandler
import logging
import logging.handlers
import os
import queue
import sys
import threading
import time

import rosgraph
import rospy

from robotont_driver.rospy_repairs import rospy_internals

MASTER_WITHIN = 10.0  # [s] for which a node waits for a master
SILENCE = 3.0  # [s] of a master, after which a tool says that it waits for it
FAREWELL = 3.0  # [s] for the last messages, and for the master to hear of the end; who ends a node waits longer
TOOLS_FAREWELL = 2.0  # [s] likewise, of a tool, which then ends by itself, with its own exit status, ...
TOOLS_END = 15.0  # [s] ... or at the latest with 1, as on a busy computer


class NoMasterError(OSError):
    """No ROS master is there; its words are for the user."""


def init_tool(name):
    """Make this process a node, beside others of that name; signals stay with the process.

    Raises NoMasterError without a master. One that hangs is waited for, with a word.
    """
    uri = rosgraph.get_master_uri()
    word = threading.Timer(SILENCE, print, [f"{name}: the ROS master at {uri} does not answer; waiting for it"],
                           {"file": sys.stderr, "flush": True})
    word.daemon = True
    word.start()
    if not rosgraph.is_master_online():
        word.cancel()
        raise NoMasterError(f"no ROS master at {uri}: is the robot running? (./robotont sim)")
    rospy_internals.mend()
    ended = threading.Event()

    def part():
        ended.wait()
        rospy.signal_shutdown("the tool has ended")

    farewell = threading.Thread(target=part, daemon=True)
    farewell.start()  # now: at its end Python starts no thread

    def leave():
        end_soon(TOOLS_END)
        ended.set()
        farewell.join(TOOLS_FAREWELL)

    atexit.register(leave)  # before rospy's own, which was registered earlier; a tool may work on after a shutdown
    rospy.init_node(name, anonymous=True, disable_signals=True)
    word.cancel()


def init_node(name):
    """Make this process the node `name`, whose end is soon and whose log calls return at once; exits without master."""
    # rospy would ask the master for a clock for 10 s, take no signal meanwhile, and end with a traceback
    end = time.monotonic() + MASTER_WITHIN
    while not rosgraph.is_master_online():
        words = f"{name}: no ROS master at {rosgraph.get_master_uri()}"
        if time.monotonic() > end:
            sys.exit(f"{words}: is the robot running? roslaunch starts a master, or roscore")
        if end - time.monotonic() > MASTER_WITHIN - 0.3:
            print(f"{words}: waiting {MASTER_WITHIN:g} s for one", file=sys.stderr, flush=True)
        time.sleep(0.4)
    rospy_internals.mend()
    rospy.on_shutdown(end_soon)  # the first of all
    rospy.init_node(name)
    for logger in [logging.root, *map(logging.getLogger, list(logging.root.manager.loggerDict))]:
        if logger.handlers:
            _queue(logger)


def end_soon(within=FAREWELL):
    """End this process `within` [s] at the latest, with status 1; the first call counts."""
    # rospy unregisters from a master, which may hang, without a time limit; all that stops a robot is sent before
    if not _ending.is_set():
        _ending.set()
        faulthandler.dump_traceback_later(within, exit=True, file=_NOWHERE)  # a thread that needs nothing of Python


_ending = threading.Event()
_NOWHERE = open(os.devnull, "w")  # noqa: SIM115  open for as long as the process lives
WAITING = 1000   # lines of the log at most; newer ones are dropped
END_WITHIN = 1.0  # [s] for those that wait when the process ends


class _DroppingHandler(logging.handlers.QueueHandler):
    def enqueue(self, record):
        with contextlib.suppress(queue.Full):
            self.queue.put_nowait(record)


def _queue(logger):
    listener = logging.handlers.QueueListener(queue.Queue(WAITING), *logger.handlers, respect_handler_level=True)
    logger.handlers = [_DroppingHandler(listener.queue)]
    listener.start()

    def end():
        with contextlib.suppress(queue.Full):
            listener.queue.put_nowait(None)  # behind the last line
            listener._thread.join(END_WITHIN)  # noqa: SLF001  QueueListener.stop waits for ever
    atexit.register(end)

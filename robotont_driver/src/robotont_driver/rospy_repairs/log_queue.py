"""Log lines that nobody waits for: the terminal, the disk and /rosout take them from a queue, in a thread of its own.

A handler of Python's logging holds up the thread that logs, which may be about to stop the robot.
"""

import atexit
import contextlib
import logging
import logging.handlers
import queue

WAITING = 1000   # lines at most; newer ones are dropped
END_WITHIN = 1.0  # [s] for the lines that wait when the process ends


class _DroppingHandler(logging.handlers.QueueHandler):
    def enqueue(self, record):
        with contextlib.suppress(queue.Full):
            self.queue.put_nowait(record)


def queue_log():
    """From now on log calls of this process return at once; call behind rospy.init_node."""
    loggers = [logging.getLogger(name) for name in list(logging.root.manager.loggerDict)]
    for logger in (logging.root, *loggers):
        if not logger.handlers or isinstance(logger.handlers[0], _DroppingHandler):
            continue
        lines = queue.Queue(WAITING)
        listener = logging.handlers.QueueListener(lines, *logger.handlers, respect_handler_level=True)
        logger.handlers = [_DroppingHandler(lines)]
        listener.start()
        atexit.register(_end, listener)


def _end(listener):
    with contextlib.suppress(queue.Full):
        listener.queue.put_nowait(None)  # behind the last line
        listener._thread.join(END_WITHIN)  # noqa: SLF001  QueueListener.stop waits for ever

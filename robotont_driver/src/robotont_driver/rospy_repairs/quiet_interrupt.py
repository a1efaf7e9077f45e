"""Imported before all else by each program: Ctrl-C ends it without a traceback, also while it loads."""

import sys


def _hook(kind, error, trace):
    if not issubclass(kind, KeyboardInterrupt):
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _hook

"""Imported before all else by programs: neither Ctrl-C nor a letter that a terminal lacks makes a traceback."""

import sys

sys.excepthook = lambda kind, *rest: issubclass(kind, KeyboardInterrupt) or sys.__excepthook__(kind, *rest)
for _stream in filter(None, (sys.stdout, sys.stderr)):
    _stream.reconfigure(errors="backslashreplace")  # where a terminal, or its encoding, has no such letter

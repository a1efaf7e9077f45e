"""A stream of bytes as lines."""

from robotont_driver.protocol.packet import LONGEST_LINE


class LineSplitter:
    """Cuts a stream of bytes into lines, however the bytes arrive."""

    def __init__(self):
        self.overlong = 0
        self._rest = b""
        self._skipping = False  # in a line that was too long, up to its end

    def feed(self, data):
        """List of the lines (bytes, without newline) that `data` completes."""
        *ended, self._rest = (self._rest + data).split(b"\n")
        lines = []
        for line in ended:
            if self._skipping:
                self._skipping = False
            elif len(line) > LONGEST_LINE:
                self.overlong += 1
            else:
                lines.append(line)
        if len(self._rest) > LONGEST_LINE:
            if not self._skipping:
                self._skipping = True
                self.overlong += 1
            self._rest = b""
        return lines

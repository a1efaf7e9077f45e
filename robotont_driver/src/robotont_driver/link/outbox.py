"""Lines that wait for the serial line: of commands only the newest, and no faster than the board can take lines."""

from collections import deque

LONGEST_QUEUE = 64  # lines of low priority, beyond which the oldest are dropped


class Outbox:
    """Lines that wait to be written: those that `hurry`, the newest command that was `put`, those `added`.

    pacing: [s] least time between the beginnings of two lines. byte_time: [s] that the serial line needs for a byte; a
    line is handed out when its predecessor is on the serial line, so never more than two are on their way; 0: at once.
    Times `now` [s] are the caller's.
    """

    def __init__(self, byte_time=0.0):
        self.pacing = 0.0
        self._byte_time = byte_time
        self.replaced = 0  # commands that a newer one overtook before they were written
        self.clear()

    def clear(self):
        """Forget all that waits; the line is free."""
        self._hurried = deque()  # (line, pause behind it)
        self._command = b""
        self._added = deque(maxlen=LONGEST_QUEUE)
        self._free_at = 0.0      # [s] from when on a line may be written
        self._pause = 0.0        # [s] behind the newest line
        self._sent_by = 0.0      # [s] when the serial line will have sent all lines

    def __bool__(self):
        """Whether any line waits."""
        return bool(self._hurried or self._command or self._added)

    def hurry(self, line, pause):
        """A line (bytes) that goes before all commands and needs a pause [s] behind it."""
        if line:
            self._hurried.append((line, pause))

    def put(self, command):
        """A command (bytes), which replaces one that still waits."""
        self.replaced += bool(self._command)
        self._command = command

    def add(self, line):
        """A line (bytes) that can wait until no command does."""
        self._added.append(line)

    def take(self, now):
        """The line to write now; empty when there is none, or it is too early."""
        if now < self._free_at:
            return b""
        pause = self.pacing
        if self._hurried:
            line, pause = self._hurried.popleft()
        elif self._command:
            line, self._command = self._command, b""
        elif self._added:
            line = self._added.popleft()
        else:
            return b""
        begins = max(now, self._sent_by)
        self._sent_by = begins + len(line) * self._byte_time
        self._pause = pause
        self._free_at = max(now + pause, begins)
        return line

    def written(self, now):
        """The line is out, which may be a while after `take`: the pause behind it begins now."""
        self._free_at = max(self._free_at, now + self._pause)

    def wait(self, now):
        """[s] until the next line may be written; None when none waits."""
        return max(0.0, self._free_at - now) if self else None

"""The newest of each task on /diagnostics, for pages and for Prometheus."""

import math
import threading

SILENT = 5.0     # [s] a task that has not come for so long is shown as silent
FORGOTTEN = 60.0  # [s] ... and then no more
SILENCE = 3      # beside the levels of diagnostic_msgs/DiagnosticStatus
MOST, LONGEST_NAME, LONGEST_WORDS, MOST_VALUES = 96, 80, 200, 100


class NewestDiagnostics:
    """namespace: only tasks of nodes in it, without its slashes at both ends."""

    def __init__(self, namespace=""):
        self._lock = threading.Lock()
        self._prefix = namespace and namespace + "/"
        self._tasks = {}  # name: (time [s], level, words, {key: number})
        self.board = ""   # its banner

    def hear(self, message, now):
        """A DiagnosticArray came at time `now` [s]."""
        with self._lock:
            for name in [name for name, task in self._tasks.items() if now - task[0] > FORGOTTEN]:
                del self._tasks[name]
            for status in message.status[:MOST]:
                name = status.name.lstrip("/")[:LONGEST_NAME]
                if not name.startswith(self._prefix) or not (name in self._tasks or len(self._tasks) < MOST):
                    continue
                level = status.level[0] if isinstance(status.level, bytes) else int(status.level)
                values = {value.key[:LONGEST_NAME]: _number(value.value) for value in status.values[:MOST_VALUES]}
                self._tasks[name] = (now, level, status.message[:LONGEST_WORDS],
                                     {key: number for key, number in values.items() if number is not None})
                self.board = next((value.value[:LONGEST_WORDS] for value in status.values if value.key == "board"),
                                  self.board)

    def lights(self, now):
        """[{"name", "level", "words"}] by name, for JSON."""
        with self._lock:
            return [{"name": name, "level": level if now - at < SILENT else SILENCE, "words": words}
                    for name, (at, level, words, _) in sorted(self._tasks.items())]

    def worst(self, now):
        """[level, task, words] of the worst, the silent ones before errors; None without any."""
        found = [[one["level"], one["name"], one["words"] if one["level"] != SILENCE else f"silent for {SILENT:g} s"]
                 for one in self.lights(now)]
        return max(found, key=lambda one: one[0]) if found else None

    def values(self, now):
        """{task: {"level", key: number}}, for JSON."""
        with self._lock:
            return {name: {"level": level if now - at < SILENT else SILENCE, **values}
                    for name, (at, level, _, values) in self._tasks.items()}


def _number(text):
    try:
        value = float(text[:40].split()[0])
    except (ValueError, IndexError):
        return None
    return value if math.isfinite(value) else None

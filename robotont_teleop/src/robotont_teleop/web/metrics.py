"""Robots as numbers for Prometheus, by its own library; free of network."""

from types import SimpleNamespace

from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from prometheus_client.core import GaugeMetricFamily

KIND = CONTENT_TYPE_LATEST
GAUGES = (  # name, meaning, value of a robot
    ("up", "1 while it is connected, has just said how it is, and its driver_node runs", lambda robot: robot["up"]),
    ("state_age_seconds", "since it has last said how it is", lambda robot: robot["age"]),
    ("battery_volts", "of the pack", lambda robot: (robot.get("battery") or {}).get("voltage")),
    ("battery_ratio", "charge, 1: full", lambda robot: (robot.get("battery") or {}).get("charge")),
    ("speed_metres_per_second", "over the floor", lambda robot: (robot.get("speed") or [None])[0]),
    ("driven_metres", "since what reports it was started", lambda robot: robot.get("driven")),
    ("emergency_stop", "1 while it is pressed", lambda robot: bool(robot.get("stopped"))),
    ("worst_level", "of its diagnostics: 0 ok, 1 warning, 2 error, 3 silent",
     lambda robot: (robot.get("worst") or {}).get("level")),
)


def metrics(robots, values):
    """Bytes of KIND.

    robots: `RobotReports.summary` of each, with "name", "up", "age" [s], "stopped", and an "id" where there are several
    of a name. values: {robot: {task: {key: number}}} of their diagnostics.
    """
    families = []
    for name, meaning, read in GAUGES:
        families.append(GaugeMetricFamily(f"robotont_{name}", meaning, labels=("robot", "id")))
        for one in robots:
            if read(one) is not None:
                families[-1].add_metric(_labels(one["name"], one.get("id", "")), float(read(one)))
    found = GaugeMetricFamily("robotont_diagnostic", "numbers of /diagnostics", labels=("robot", "task", "key"))
    for robot, tasks in sorted(values.items()):
        for task, numbers in sorted(tasks.items()):
            for key, number in sorted(numbers.items()):
                found.add_metric(_labels(robot, task, key), float(number))
    return generate_latest(SimpleNamespace(collect=lambda: [*families, found]))  # as of its registries


def _labels(*words):
    """What is no Unicode, as JSON's half a surrogate pair, would end the text of all."""
    return tuple(word.encode("utf-8", "replace").decode() for word in words)

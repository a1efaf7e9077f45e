"""Robots as numbers for Prometheus, in its text format 0.0.4; free of network."""

KIND = "text/plain; version=0.0.4; charset=utf-8"
GAUGES = (  # name, meaning, value of a robot's view
    ("up", "1 while it is connected", lambda robot: robot["present"]),
    ("state_age_seconds", "since it has last said how it is", lambda robot: robot["age"]),
    ("battery_volts", "of the pack", lambda robot: (robot.get("battery") or {}).get("voltage")),
    ("battery_ratio", "charge, 1: full", lambda robot: (robot.get("battery") or {}).get("charge")),
    ("speed_metres_per_second", "over the floor", lambda robot: (robot.get("speed") or [None])[0]),
    ("driven_metres", "since what reports it was started", lambda robot: robot.get("driven")),
    ("emergency_stop", "1 while it is pressed", lambda robot: bool(robot.get("stopped"))),
    ("worst_level", "of its diagnostics: 0 ok, 1 warning, 2 error, 3 silent",
     lambda robot: (robot.get("worst") or [None])[0]),
)


def metrics(robots, values):
    """Text. robots: as in robotont_fleet's Fleet.view; values: {robot: {task: {key: number}}} of their diagnostics."""
    lines = []
    for name, meaning, read in GAUGES:
        lines += [f"# HELP robotont_{name} {meaning}", f"# TYPE robotont_{name} gauge"]
        lines += [f"robotont_{name}{_labels(robot=one['name'], id=one['id'])} {float(read(one)):g}" for one in robots
                  if read(one) is not None]
    lines += ["# HELP robotont_diagnostic numbers of /diagnostics, by task and key", "# TYPE robotont_diagnostic gauge"]
    for robot, tasks in sorted(values.items()):
        lines += [f"robotont_diagnostic{_labels(robot=robot, task=task, key=key)} {float(number):g}"
                  for task, numbers in sorted(tasks.items()) for key, number in sorted(numbers.items())]
    return "\n".join(lines) + "\n"


def _labels(**labels):
    escaped = {name: str(value).replace("\\", r"\\").replace('"', r"\"").replace("\n", r"\n")
               for name, value in labels.items()}
    return "{" + ",".join(f'{name}="{value}"' for name, value in escaped.items()) + "}"

"""The driver's latency, losses, processor time, memory and start: each arrangement beside the floor."""

import gc
import time

from rig import Loop, SilenceError, late
from subjects import COMPOSED, COUNTED, FLOOR, OURS, RATE, WAYS, Subject, measure

from robotont_testing.figures import percentile, row
from robotont_testing.harness import Master

TITLES = (FLOOR, *OURS)


class Rounds:
    """Values by (title of a subject, name of a figure), one per round."""

    def __init__(self):
        self._values = {}

    def add(self, subject, name, value):
        """One round's."""
        self._values.setdefault((subject, name), []).append(value)

    def of(self, subject, name):
        """All rounds'; empty where there are none."""
        return self._values.get((subject, name), [])

    def row(self, subject, name, unit, bound="", note=""):
        """A row of the table, beside the same figure of the floor."""
        beside = [] if subject == FLOOR else self.of(FLOOR, name)
        return row(name, self.of(subject, name), unit, beside, bound, note, subject)


def bench_latency(options):
    """Rows at 50 Hz both ways, in alternating rounds."""
    loop, rounds = Loop(), Rounds()
    with Master() as master:
        found = [Subject(loop, master, title, f"robot{number}") for number, title in enumerate(TITLES)]
        for subject in found:
            subject.start()
            subject.connect()
        gc.freeze()
        for _ in range(options.rounds):
            for subject in found:
                title = subject.title
                rounds.add(title, "processor", 100 * measure(loop, subject, options.seconds))
                for way, stream in WAYS:
                    add_delays(rounds, title, way, getattr(subject.robot, stream))
    rows = []
    for way, _ in WAYS:
        rows += [rounds.row(title, f"{way}, p50", "ms", "<= 1.1 x floor" if title == COMPOSED else "")
                 for title in TITLES]
        rows += [rounds.row(title, f"{way}, p99", "ms") for title in TITLES]
        rows += [losses(rounds, title, way) for title in TITLES]
    rows += [rounds.row(title, "processor", "% of a core", "<= 1.5 x floor" if title == COMPOSED else "",
                        "50 Hz both ways") for title in TITLES]
    return [*rows, row("the bench's own delay, p99", late(loop), "ms", note="how quiet the machine was")]


def losses(rounds, title, way):
    """The row of what did not arrive in all rounds together."""
    total = {what: sum(rounds.of(title, f"{way}, {what}")) for what in COUNTED}
    note = "of {sent}; {overtaken} overtaken by newer ones; {repeated} repeated, {unexpected} unexplained".format(
        **total)
    return row(f"{way}, lost", total["lost"], "packets", bound="= 0" if title in OURS else "", note=note, subject=title)


def add_delays(rounds, title, way, stream):
    """Percentiles, where anything arrived, and losses of one round."""
    if stream.delays:
        rounds.add(title, f"{way}, p50", 1000 * percentile(stream.delays, 0.5))
        rounds.add(title, f"{way}, p99", 1000 * percentile(stream.delays, 0.99))
    for what in COUNTED:
        rounds.add(title, f"{way}, {what}", getattr(stream, what))


def bench_start(options):
    """Rows of the time to the first /odom and of memory, each subject alone with a master of its own."""
    rounds = Rounds()
    for _ in range(options.rounds):
        for title in TITLES:
            start_alone(title, rounds)
    rows = []
    for title in TITLES:
        rows += [rounds.row(title, "start to first /odom", "s", "<= 0.6" if title == COMPOSED else "",
                            "from the master's first answer; roslaunch starts both" if title in OURS
                            else "from its start"),
                 rounds.row(title, "memory (PSS)", "MiB", "<= 55" if title == COMPOSED else "")]
    return rows


def start_alone(title, rounds):
    """One round of one subject."""
    loop = Loop()
    ours = title in OURS
    with Master(start=not ours) as master:
        subject = Subject(loop, master, title, "robot")
        begin = time.monotonic()
        subject.start()
        if ours:
            master.wait()
            begin = time.monotonic()
        robot = subject.robot
        robot.register()
        loop.every(1 / RATE, robot.report)
        if not loop.run(until=lambda: robot.odom_at):
            raise SilenceError(f"{title} has no odometry")
        rounds.add(title, "start to first /odom", robot.odom_at - begin)
        loop.idle()
        subject.connect()
        rounds.add(title, "memory (PSS)", subject.memory())


PARTS = (bench_latency, bench_start)

"""The driver's latency, losses, processor time, memory and start: each arrangement beside the floor, and peers."""

import gc
import sys
import time

from rig import Loop, SilenceError, late
from subjects import COMPOSED, COUNTED, FLOOR, OURS, RATE, THREE, WAYS, Subject, measure

from robotont_testing.figures import percentile, row
from robotont_testing.harness import Master


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

    def ratio(self, name, subject, floor, figure, bound, other=None):
        """The row of a figure relative to another subject's (or to the subject's other figure), round by round."""
        pairs = zip(self.of(subject, figure), self.of(floor, other or figure))
        return row(name, [value / beside for value, beside in pairs if beside], "x", bound=bound, subject=subject)


def subjects(loop, master, options):
    """Connected `Subject`s, peers included, and rows that name those that do not work."""
    found, rows = [], []
    for number, title in enumerate([FLOOR, *OURS, *options.peer]):
        subject = Subject(loop, master, title, f"robot{number}", peer_board=options.peer_board)
        subject.start()
        try:
            subject.connect()
        except SilenceError as silence:
            if not subject.is_peer:
                raise
            rows.append(row("does not work", None, "", note=str(silence).splitlines()[0], subject=subject.title))
            print(silence, file=sys.stderr, flush=True)
            subject.robot.close()
        else:
            found.append(subject)
    gc.freeze()
    return found, rows


def bench_latency(options):
    """Rows at 50 Hz both ways, in alternating rounds."""
    loop, rounds = Loop(), Rounds()
    with Master() as master:
        found, rows = subjects(loop, master, options)
        for _ in range(options.rounds):
            for subject in found:
                title = subject.title
                rounds.add(title, "processor", 100 * measure(loop, subject, options.seconds))
                for way, stream in WAYS:
                    add_delays(rounds, title, way, getattr(subject.robot, stream))
    titles = [subject.title for subject in found]
    for way, _ in WAYS:
        rows += [rounds.row(title, f"{way}, p50", "ms", "<= 1.1 x floor" if title == COMPOSED else "")
                 for title in titles]
        rows += [rounds.row(title, f"{way}, p99", "ms") for title in titles]
        rows += [rounds.ratio(f"{way}, p99 / p50", title, title, f"{way}, p99", "<= 3" if title == COMPOSED else "",
                              f"{way}, p50") for title in titles]
        rows += [losses(rounds, title, way) for title in titles]
    rows += [rounds.row(title, "processor", "% of a core", "<= 1.5 x floor" if title == COMPOSED else "",
                        "50 Hz both ways") for title in titles]
    rows.append(rounds.ratio("processor, of three processes'", COMPOSED, THREE, "processor", "<= 0.6"))
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
    rounds, titles = Rounds(), []
    for _ in range(options.rounds):
        titles = [start_alone(what, options, rounds) for what in [FLOOR, *OURS, *options.peer]]
    rows = []
    for title in titles:
        rows += [rounds.row(title, "start to first /odom", "s", "<= 0.6" if title == COMPOSED else "",
                            "from the master's first answer; roslaunch starts both" if title in OURS
                            else "from its start"),
                 rounds.row(title, "memory (PSS)", "MiB", "<= 55" if title == COMPOSED else "")]
    return rows


def start_alone(what, options, rounds):
    """One round of one subject, whose title is returned; a peer that does not work adds nothing."""
    loop = Loop()
    ours = what in OURS
    with Master(start=not ours) as master:
        subject = Subject(loop, master, what, "robot", peer_board=options.peer_board)
        begin = time.monotonic()
        subject.start()
        if ours:
            master.wait()
            begin = time.monotonic()
        robot = subject.robot
        robot.register()
        loop.every(1 / RATE, robot.report)
        if loop.run(until=lambda: robot.odom_at):
            rounds.add(subject.title, "start to first /odom", robot.odom_at - begin)
            loop.idle()
            subject.connect()
            rounds.add(subject.title, "memory (PSS)", subject.memory())
        return subject.title


PARTS = (bench_latency, bench_start)

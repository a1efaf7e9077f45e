"""The driver's latency, losses, processor time, memory and start: each arrangement beside the floor, and peers."""

import gc
import statistics
import sys
import time
from collections import deque

import numpy as np
from rig import Loop, SilenceError, late
from subjects import COMPOSED, COUNTED, FLOOR, RATE, THREE, WAYS, Subject, arrangements, measure, title_of

from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.gyro import Gyro
from robotont_driver.odometry.gyro_fusion import GyroFusion
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.odometry.slip import SlipDetector
from robotont_testing import other_noise
from robotont_testing.figures import percentile, row
from robotont_testing.harness import Master
from robotont_testing.robots import SHIPPED
from robotont_testing.simulated_wheels import PERIOD, counted, even_wheels, mixed_drive, rolled

STOPS = 10           # per round
FLOOD = 0.3          # [s] of commands at FAST before each stop
FAST = 1000          # [Hz]
MANY_WHEELS = 12
WHEEL_NOISE, FALSE_ALARMS = 0.012, 0.1  # the defaults of odom_node


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
    for number, title in enumerate([FLOOR, *arrangements(), *options.peer]):
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
                rounds.add(title, "processor", 100 * measure(loop, [subject], RATE, options.seconds))
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
    if COMPOSED in titles:
        rows.append(rounds.ratio("processor, of three processes'", COMPOSED, THREE, "processor", "<= 0.6"))
    return [*rows, row("the bench's own delay, p99", late(loop), "ms", note="how quiet the machine was")]


def losses(rounds, title, way, when=""):
    """The row of what did not arrive in all rounds together."""
    total = {what: sum(rounds.of(title, f"{way}, {what}")) for what in COUNTED}
    note = "of {sent}; {overtaken} overtaken by newer ones; {repeated} repeated, {unexpected} unexplained".format(
        **total)
    return row(f"{way}{when}, lost", total["lost"], "packets", bound=aim_of(title), note=note, subject=title)


def aim_of(title):
    """Bound of losses: for what this project ships."""
    return "= 0" if title in (THREE, COMPOSED) else ""


def add_delays(rounds, title, way, stream):
    """Percentiles, where anything arrived, and losses of one round."""
    if stream.delays:
        rounds.add(title, f"{way}, p50", 1000 * percentile(stream.delays, 0.5))
        rounds.add(title, f"{way}, p99", 1000 * percentile(stream.delays, 0.99))
    for what in COUNTED:
        rounds.add(title, f"{way}, {what}", getattr(stream, what))


def bench_stop(options):
    """Rows of the delay of a zero command at the end of a flood of others."""
    loop, rounds = Loop(), Rounds()
    moved = {}
    with Master() as master:
        found, rows = subjects(loop, master, options)
        for _ in range(options.rounds):
            for subject in found:
                delays = [delay for delay in (stop_after_flood(loop, subject.robot) for _ in range(STOPS)) if delay]
                moved[subject.title] = moved.get(subject.title, 0) + STOPS - len(delays)
                if delays:
                    rounds.add(subject.title, "command to stop, p50", 1000 * percentile(delays, 0.5))
                    rounds.add(subject.title, "command to stop, longest", 1000 * max(delays))
    name = f"{FAST} commands/s before it, {STOPS} stops a round"
    for subject in found:
        title = subject.title
        rows += [rounds.row(title, "command to stop, p50", "ms", "<= 1.1 x floor" if title == COMPOSED else "", name),
                 rounds.row(title, "command to stop, longest", "ms"),
                 row("commands to stop without effect", moved[title], "stops", bound=aim_of(title),
                     note="within 1 s, or followed by another command", subject=title)]
    return [*rows, row("the bench's own delay, p99", late(loop), "ms", note="how quiet the machine was")]


def stop_after_flood(loop, robot):
    """[s] from a zero command to the first line that says so, at the end of a flood; None if it moves on after 1 s."""
    loop.every(1 / FAST, robot.command)
    loop.run(FLOOD)
    loop.idle()
    robot.stops.clear()
    begin = robot.command(0)
    loop.run(1.0, lambda: robot.stops)
    robot.moves.clear()
    loop.run(0.1)
    if not robot.stops or robot.moves:
        return None
    return robot.stops[0] - begin


def bench_throughput(options):
    """Rows of 1000 packets/s both ways."""
    loop, rounds = Loop(), Rounds()
    quick = faster(SHIPPED, FAST)
    rows = []
    for title in (FLOOR, *arrangements()):
        with Master() as master:
            subject = Subject(loop, master, title, "robot", quick)
            subject.start()
            subject.connect()
            rounds.add(title, "processor", 100 * measure(loop, [subject], FAST, options.burst))
            for way, name in WAYS:
                stream = getattr(subject.robot, name)
                add_delays(rounds, title, way, stream)
                figure = f"{way} at {FAST}/s"
                if stream.delays:
                    rounds.add(title, figure + ", delay at the end",
                               1000 * percentile(stream.delays[-FAST // 10:], 0.5))
                rows += [losses(rounds, title, way, f" at {FAST}/s"),
                         rounds.row(title, figure + ", delay at the end", "ms", "<= 5" if title == COMPOSED else "",
                                    "median of the last 0.1 s"),
                         row(figure + ", p99", rounds.of(title, f"{way}, p99"), "ms", subject=title)]
            rows.append(row(f"processor at {FAST}/s both ways", rounds.of(title, "processor"), "% of a core",
                            subject=title))
            subject.robot.close()
    return [*rows, row("the bench's own delay, p99", late(loop), "ms", note="how quiet the machine was")]


def faster(parameters, rate):
    """Wheel parameters of a robot whose board sends at another rate [Hz], with as many edges per packet."""
    edges = parameters["encoderEdgesPerMotorRevolution"] * rate // parameters["pidControlFrequency"]
    return {**parameters, "pidControlFrequency": rate, "encoderEdgesPerMotorRevolution": edges}


def bench_wheels(options):
    """Rows of 12 wheels beside 3, in alternating rounds; the floor of this part is the driver with 3 wheels."""
    loop, rounds = Loop(), Rounds()
    best = arrangements()[-1]
    robots = {}
    with Master() as master:
        for wheels in (3, MANY_WHEELS):
            robots[wheels] = Subject(loop, master, best, f"wheels{wheels}", even_wheels(wheels))
            robots[wheels].start()
            robots[wheels].connect()
        for _ in range(options.rounds):
            for wheels, subject in robots.items():
                rounds.add(wheels, "processor", 100 * measure(loop, [subject], RATE, options.seconds))
                for way, stream in WAYS:
                    add_delays(rounds, wheels, way, getattr(subject.robot, stream))
    figures = [("processor", "% of a core"), *((f"{way}, {part}", "ms") for way, _ in WAYS for part in ("p50", "p99"))]
    return [row(f"{name}, {MANY_WHEELS} wheels", rounds.of(MANY_WHEELS, name), unit, rounds.of(3, name),
                "" if "p99" in name else "<= 1.5 x floor", "floor: 3 wheels", best) for name, unit in figures]


def bench_odometry(options):
    """Rows of the processor time of a packet in the odometry of three wheels, without and with a gyro."""
    wheels, rng = read_wheels(SHIPPED), np.random.default_rng(1)
    twists = np.concatenate([np.zeros((100, 3)), other_noise.joystick(options.seconds, rng)])
    counts, samples = other_noise.counts(wheels, twists, rng, WHEEL_NOISE).tolist(), other_noise.gyro(twists, rng)
    samples = list(zip((1e9 * samples[0]).astype(int).tolist(), samples[1].tolist()))
    rows = []
    for what, bound in (("3 wheels", 12), ("3 wheels and a gyro", 60)):
        times = []
        for _ in range(options.rounds):
            fusion = GyroFusion(Gyro(PERIOD, 2.5e-4, 7e-5, 1.0, 0.01), FALSE_ALARMS) if "gyro" in what else None
            odometry, waiting = WheelOdometry(Kinematics(wheels), PERIOD, WHEEL_NOISE, fusion), deque(samples)
            spent = []
            for number, packet in enumerate(counts, 1):
                stamp = round(number * PERIOD * 1e9)
                while fusion and waiting and waiting[0][0] <= stamp + 5_000_000:
                    fusion.integral.add(*waiting.popleft())
                spent.append(1e6 * processor_time(odometry.update, packet, PERIOD, stamp))
            times.append(statistics.median(spent))
        rows.append(row(f"odometry, {what}, p50", times, "us", bound=f"<= {bound}"))
    return rows


def bench_slip(options):
    """Rows of the processor time of a packet in the search for slip; the floor leaves out each wheel once."""
    wheels = read_wheels(even_wheels(MANY_WHEELS))
    matrix, generator = Kinematics(wheels).matrix, np.random.default_rng(1)
    driven = counted(wheels, rolled(wheels, mixed_drive(options.seconds, generator)), WHEEL_NOISE, generator)
    rows = []
    for what, counts in (("all roll", driven), ("wheels in a wrong order", generator.permutation(driven.T).T),
                         ("counts at random", generator.integers(-60, 60, driven.shape))):
        times, floors = [], []
        for _ in range(options.rounds):
            detector = SlipDetector(matrix, wheels.metres_per_edge, WHEEL_NOISE, FALSE_ALARMS, 1 / PERIOD)
            times.append([1000 * processor_time(detector.update, packet) for packet in counts.tolist()])
            floors.append(1000 * statistics.median(
                processor_time(leave_one_out, matrix, packet) for packet in counts[:100]))
        note = f"{MANY_WHEELS} wheels, {what}"
        rows += [row(f"search for slip, {what}, p50", list(map(statistics.median, times)), "ms", floors, note=note),
                 row(f"search for slip, {what}, longest", max(map(min, zip(*times))), "ms", floors, "<= 2",
                     note + "; of each packet the shortest time of all rounds")]
    return rows


def processor_time(function, *arguments):
    """[s] that a call takes of this thread's."""
    begin = time.thread_time()
    function(*arguments)
    return time.thread_time() - begin


def leave_one_out(matrix, counts):
    """The steps that the counts give without each of the wheels: the simplest search."""
    for wheel in range(len(matrix)):
        np.linalg.lstsq(np.delete(matrix, wheel, axis=0), np.delete(counts, wheel), rcond=None)


def bench_start(options):
    """Rows of the time to the first /odom and of memory, each subject alone with a master of its own."""
    rounds = Rounds()
    everything = [FLOOR, *arrangements(), *options.peer]
    for _ in range(options.rounds):
        for what in everything:
            seconds, memory = start_alone(what, options)
            if seconds is not None:
                rounds.add(title_of(what), "start to first /odom", seconds)
                rounds.add(title_of(what), "memory (PSS)", memory)
    rows = []
    for title in map(title_of, everything):
        rows += [rounds.row(title, "start to first /odom", "s", "<= 0.6" if title == COMPOSED else "",
                            "from the master's first answer; roslaunch starts both" if title in arrangements()
                            else "from its start"),
                 rounds.row(title, "memory (PSS)", "MiB", "<= 55" if title == COMPOSED else "")]
    return rows


def start_alone(what, options):
    """[s] to the first odometry and [MiB] then; None twice for a peer that does not work."""
    loop = Loop()
    ours = what in arrangements()
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
        if not loop.run(until=lambda: robot.odom_at):
            return None, None
        seconds = robot.odom_at - begin
        loop.idle()
        subject.connect()
        return seconds, subject.memory()


PARTS = (bench_latency, bench_stop, bench_throughput, bench_wheels, bench_odometry, bench_slip, bench_start)

"""What more wheels, more packets and more robots cost, and where it ends: one machine, the driver's best arrangement.

The other ends of all robots are one thread of one process (rig.py), whose own share stands beside theirs.
"""

import gc
import sys
import time
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from bench_driver import faster
from rig import PATIENCE, Loop, late
from subjects import RATE, WAYS, Subject, arrangements, launch_arguments, measure, processor_time

from robotont_calibration.trajectory_errors import BLUE, GREY, INK, ORANGE, drawing_style, pyplot
from robotont_testing import places
from robotont_testing.figures import percentile, reached, row
from robotont_testing.harness import Master, free_port, wait_for_master
from robotont_testing.robots import SHIPPED
from robotont_testing.simulated_wheels import even_wheels

WHEELS = (3, 4, 5, 6, 8, 10, 12)
RATES = (50, 100, 200, 500, 1000)       # [Hz]
ROBOTS = (1, 2, 5, 10, 20, 30, 40, 50, 60)
LATEST = 20.0                           # [ms] p99 beyond which, or with a loss, it counts as broken
COMMANDS, PACKETS = (way for way, _ in WAYS)
LOST = ((COMMANDS, "commands overtaken"), (PACKETS, "packets lost"))
ONE, EACH = "one master", "one master each"


class Fleet:
    """Robots robot0, robot1, ..., all with the same wheels, on `master` or with a master each."""

    def __init__(self, master, each=False):
        self.loop = Loop()
        self.subjects = []
        self._master, self._each = master, each

    def grow(self, number, parameters=SHIPPED):
        """Start more robots, until there are so many, and connect to them."""
        title = arrangements()[-1]
        new = []
        while len(self.subjects) < number:
            new.append(Subject(self.loop, self._master, title, f"robot{len(self.subjects)}", parameters))
            self.subjects.append(new[-1])
        if self._each:
            for subject in new:
                self._start_with_master(subject)
        else:
            self._start_together(new)
        for subject in new:
            wait_for_master(subject.robot.uri, PATIENCE)
            subject.connect()
        gc.freeze()

    def _start_together(self, subjects):
        """By one roslaunch."""
        file = self._master.folder / f"{subjects[0].name}.launch"
        includes = []
        for subject in subjects:
            pairs = [argument.split(":=", 1) for argument in launch_arguments(subject.robot, subject.title)]
            values = "".join(f"<arg name={quoteattr(name)} value={quoteattr(value)}/>" for name, value in pairs)
            includes.append(f"<include file={quoteattr(str(places.launch('robot.launch')))}>{values}</include>")
        file.write_text("<launch>" + "".join(includes) + "</launch>")
        self._master.launch(str(file), log=subjects[0].log)
        for subject in subjects:
            subject.log = subjects[0].log

    def _start_with_master(self, subject):
        port = free_port()
        subject.robot.uri = f"http://127.0.0.1:{port}"
        self._master.start("roslaunch", "-p", port, places.launch("robot.launch"),
                           *launch_arguments(subject.robot, subject.title), log=subject.log,
                           ROS_MASTER_URI=subject.robot.uri)

    def measure(self, seconds, rate=RATE):
        """Figures of all robots together at a rate [Hz], by name."""
        masters = [wait_for_master(uri) for uri in {subject.robot.uri for subject in self.subjects}]
        costs = [(sum(map(processor_time, masters)), time.process_time(), *machine())]
        begin = time.monotonic()
        used = measure(self.loop, self.subjects, rate, seconds)
        elapsed = time.monotonic() - begin
        costs.append((sum(map(processor_time, masters)), time.process_time(), *machine()))
        master, rig, busy, total = (after - before for before, after in zip(*costs))
        streams = {way: [getattr(subject.robot, name) for subject in self.subjects] for way, name in WAYS}
        found = {"processor": 100 * used, "per robot": 100 * used / len(self.subjects),
                 "rosmaster": 100 * master / elapsed, "bench": 100 * rig / elapsed, "machine": 100 * busy / total,
                 "sent": sum(stream.sent for stream in streams[COMMANDS])}
        for way, both in streams.items():
            found[f"{way} lost"] = sum(stream.lost for stream in both)
            delays = [delay for stream in both for delay in stream.delays]
            found[way] = 1000 * percentile(delays, 0.99) if delays else None
        return found


def machine():
    """[ticks] that all cores were busy, and in all, since the start of the machine."""
    fields = list(map(int, Path("/proc/stat").read_text().splitlines()[0].split()[1:9]))
    idle = fields[3] + fields[4]
    return sum(fields) - idle, sum(fields)


def rows_of(found, at, kind, subject):
    """Rows of one step: `at` is the number of wheels, the rate or the number of robots."""
    note = "machine busy {machine:.0f} %, rosmaster {rosmaster:.1f}, bench {bench:.1f} % of a core".format(**found)
    rows = [row(f"{kind}, processor", found["processor"], "% of a core", note=note, subject=subject)]
    rows += [row(f"{kind}, {way} p99", found[way], "ms", bound=f"<= {LATEST:g}", subject=subject) for way, _ in WAYS]
    rows += [row(f"{kind}, {what}", found[f"{way} lost"], "", bound="= 0", note="of {sent}".format(**found),
                 subject=subject) for way, what in LOST]
    return [{**line, "at": at} for line in rows]


def bench_wheels(options):
    """Rows over the number of wheels."""
    rows = []
    for wheels in WHEELS:
        with Master() as master:
            fleet = Fleet(master)
            fleet.grow(1, even_wheels(wheels))
            rows += rows_of(fleet.measure(options.seconds), wheels, "wheels", f"{wheels} wheels")
    return rows


def bench_rates(options):
    """Rows over the rate of packets and commands."""
    rows = []
    for rate in RATES:
        with Master() as master:
            fleet = Fleet(master)
            fleet.grow(1, faster(SHIPPED, rate))
            rows += rows_of(fleet.measure(options.seconds, rate), rate, "rate", f"{rate}/s both ways")
    return [*rows, broken(rows, "rate", "packets/s both ways")]


def bench_robots(options):
    """Rows over the number of robots, on one master and with one each."""
    rows = []
    for masters, each in ((ONE, False), (EACH, True)):
        mine = []
        with Master() as master:
            fleet = Fleet(master, each)
            for number in (number for number in ROBOTS if number <= options.robots):
                fleet.grow(number)
                mine += rows_of(fleet.measure(options.seconds), number, masters, f"{number} robots")
        rows += [*mine, broken(mine, masters, "robots")]
    return rows


def broken(rows, kind, unit):
    """The row that says where a packet is lost or the p99 is beyond LATEST."""
    bad = [line["at"] for line in rows if line["name"].endswith(("p99", "packets lost")) and not reached(line)]
    most = max(line["at"] for line in rows)
    return row(f"{kind}, first packet lost or p99 > {LATEST:g} ms", min(bad, default=None), unit,
               note="" if bad else f"not up to {most}")


def bench_endurance(options):
    """Rows of many robots for a long time on one master, minute by minute, beside one robot alone."""
    with Master() as master:
        fleet = Fleet(master)
        fleet.grow(1)
        alone = fleet.measure(options.seconds)
        fleet.grow(options.robots)
        before = sum(subject.memory() for subject in fleet.subjects)
        minutes = []
        left = 60 * options.minutes
        while left > 0:
            minutes.append(fleet.measure(min(60.0, left)))
            left -= 60.0
            print("minute {}: {per robot:.2f} % of a core per robot".format(len(minutes), **minutes[-1]),
                  file=sys.stderr, flush=True)
        after = sum(subject.memory() for subject in fleet.subjects)
        delay = late(fleet.loop)
    subject = f"{options.robots} robots for {options.minutes:g} min"
    rows = [row("processor per robot", [minute["per robot"] for minute in minutes], "% of a core", alone["per robot"],
                "<= 1.2 x floor", "floor: one robot alone", subject),
            row("processor per robot, dearest minute / cheapest", max(minute["per robot"] for minute in minutes) /
                min(minute["per robot"] for minute in minutes), "x", bound="<= 1.2", subject=subject),
            *(row(what, sum(minute[f"{way} lost"] for minute in minutes), "", bound="= 0",
                  note="of {}".format(sum(minute["sent"] for minute in minutes)), subject=subject)
              for way, what in LOST)]
    rows += [row(f"{way} p99", [minute[way] for minute in minutes if minute[way]], "ms", alone[way], f"<= {LATEST:g}",
                 "floor: one robot alone", subject) for way, _ in WAYS]
    rows += [row(name, [minute[key] for minute in minutes], unit, note=note, subject=subject)
             for name, key, unit, note in (("machine busy", "machine", "%", "of all cores"),
                                           ("rosmaster", "rosmaster", "% of a core", ""),
                                           ("the bench itself", "bench", "% of a core", ""))]
    return [*rows, row("memory (PSS), all robots, at the end", after, "MiB", note=f"{before:.0f} at the beginning",
                       subject=subject), row("the bench's own delay, p99", delay, "ms")]


def draw(rows, file):
    """The picture: cost over wheels, rates and robots beside straight lines, and delays over robots."""
    panels = [(draw_wheels, "wheels"), (draw_rates, "rate"), (draw_robots, ONE), (draw_delays, ONE)]
    panels = [panel for panel, kind in panels if len(curve(rows, f"{kind}, processor")[0])]
    plt = pyplot()
    with plt.rc_context(drawing_style()):
        figure, axes = plt.subplots((len(panels) + 1) // 2, 2, figsize=(9.6, 3.6 * ((len(panels) + 1) // 2)),
                                    constrained_layout=True, squeeze=False)
        for panel, place in zip(panels, axes.flat):
            panel(place, rows)
            place.set_xlim(0, None)
            place.xaxis.get_major_locator().set_params(integer=True)
        for place in axes.flat[len(panels):]:
            place.set_axis_off()
        figure.savefig(file)
        plt.close(figure)


def draw_wheels(axes, rows):
    """Cost over the number of wheels."""
    draw_cost(axes, rows, "wheels", BLUE, "measured")
    draw_line(axes, rows, "wheels")
    axes.set(title="One robot at 50 Hz, by wheels", xlabel="wheels", ylabel="processor [% of a core]", ylim=(0, None))
    axes.legend(frameon=False, loc="lower right")


def draw_rates(axes, rows):
    """Cost over the rate."""
    draw_cost(axes, rows, "rate", BLUE, "measured")
    draw_line(axes, rows, "rate")
    axes.set(title="One robot, by rate", xlabel="packets and commands per second", ylabel="processor [% of a core]",
             ylim=(0, None))
    axes.legend(frameon=False, loc="lower right")


def draw_robots(axes, rows):
    """Cost over the number of robots, beside so many times one robot."""
    at, values = curve(rows, f"{ONE}, processor")
    axes.plot((0, at[-1]), (0, values[0] / at[0] * at[-1]), color=GREY, linewidth=1.2, zorder=0,
              label="as many times one robot")
    for kind, colour in ((ONE, BLUE), (EACH, ORANGE)):
        draw_cost(axes, rows, kind, colour, kind)
    axes.set(title="Robots at 50 Hz: all nodes together", xlabel="robots", ylabel="processor [% of a core]",
             ylim=(0, None))
    axes.legend(frameon=False, loc="upper left")


def draw_delays(axes, rows):
    """The p99 of both ways over the number of robots."""
    for kind, colour in ((ONE, BLUE), (EACH, ORANGE)):
        for (way, _), style in zip(WAYS, ("-", ":")):
            at, values = curve(rows, f"{kind}, {way} p99")
            axes.plot(at, values, style, marker="o", markersize=4, color=colour,
                      label=way if kind == ONE else f"{way}, {kind}")
    axes.axhline(LATEST, color=INK, linewidth=0.8)
    axes.set(title="Robots at 50 Hz: delay, p99", xlabel="robots", ylabel="[ms]", yscale="log")
    low, high = axes.get_ylim()
    ticks = [tick for tick in (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if low <= tick <= high * 3]
    axes.set_yticks(ticks)
    axes.set_yticklabels([f"{tick:g}" for tick in ticks])
    axes.set_ylim(low, high * 3)  # room for the legend
    axes.minorticks_off()
    axes.legend(frameon=False, loc="upper left", fontsize=8, ncol=2)


def draw_cost(axes, rows, kind, colour, label):
    """Processor time of one kind of rows."""
    axes.plot(*curve(rows, f"{kind}, processor"), marker="o", markersize=4, color=colour, label=label)


def draw_line(axes, rows, kind):
    """The straight line that fits best, if there is one."""
    at, values = curve(rows, f"{kind}, processor")
    if len(at) > 1:
        axes.plot(at, np.polyval(np.polyfit(at, values, 1), at), color=GREY, linewidth=1.2, zorder=0,
                  label="straight line")


def curve(rows, name):
    """Places and values of the rows with that name."""
    points = [(line["at"], line["value"]) for line in rows if line["name"] == name]
    return tuple(np.array(points).T) if points else (np.array([]), np.array([]))


PARTS = (bench_wheels, bench_rates, bench_robots, bench_endurance)

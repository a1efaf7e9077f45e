"""What fleet_node costs the driver beside it: two robots with masters of their own, one of them in a fleet."""

import time

from bench_driver import Rounds, add_delays
from rig import Loop, late
from subjects import COMPOSED, RATE, WAYS, Subject, measure, memory, processor_time

from robotont_fleet.zenoh_setup import ABSENT, zenoh
from robotont_testing import places
from robotont_testing.figures import row
from robotont_testing.harness import Master, Processes, free_port
from robotont_testing.robots import SHIPPED

ALONE, BESIDE = "driver alone", "driver beside fleet_node"
SETTLED = 5.0  # [s] for fleet_node to find the router


def bench_driver(options):
    """Rows at 50 Hz both ways, in alternating rounds."""
    if zenoh is None:
        return [row("does not work", None, "", note=ABSENT)]
    loop, rounds = Loop(), Rounds()
    port = free_port()
    with Processes() as fleet, Master() as first, Master() as second:
        fleet.start(places.program("robotont_fleet", "fleet"), "--port", free_port(), "--router-port", port,
                    log=fleet.folder / "page.log", ROS_HOME=str(fleet.folder))
        found = []
        for master, title, name in ((first, ALONE, "robot0"), (second, BESIDE, "robot1")):
            subject = Subject(loop, master, COMPOSED, name, SHIPPED)
            subject.start()
            subject.connect()
            subject.title = title
            found.append(subject)
        node = fleet.start(places.program("robotont_fleet", "fleet_node"), f"_router:=tcp/127.0.0.1:{port}",
                           ROS_MASTER_URI=second.uri, ROS_NAMESPACE="robot1", ROS_HOME=str(fleet.folder)).pid
        time.sleep(SETTLED)
        for _ in range(options.rounds):
            for subject in found:
                used, began = processor_time(node), time.monotonic()
                rounds.add(subject.title, "processor", 100 * measure(loop, [subject], RATE, options.seconds))
                rounds.add(subject.title, "fleet_node, processor",
                           100 * (processor_time(node) - used) / (time.monotonic() - began))
                for way, stream in WAYS:
                    add_delays(rounds, subject.title, way, getattr(subject.robot, stream))
        size = memory(node)
    rows = []
    for figure in (*(f"{way}, {point}" for way, _ in WAYS for point in ("p50", "p99")), "processor"):
        unit = "% of a core" if figure == "processor" else "ms"
        rows += [rounds.row(title, figure, unit) for title in (ALONE, BESIDE)]
        rows.append(rounds.ratio(f"{figure}, of {ALONE}", BESIDE, ALONE, figure, "" if "p99" in figure else "<= 1.1"))
    return [*rows, rounds.row(BESIDE, "fleet_node, processor", "% of a core", "<= 3"),
            row("fleet_node, memory", size, "MiB", bound="<= 60", note="PSS", subject=BESIDE),
            row("the bench's own delay, p99", late(loop), "ms", note="how quiet the machine was")]


PARTS = (bench_driver,)

"""The driver's latency, throughput, processor time, memory and start, each beside its floor."""

import os
import select
import statistics
import threading
import time
import tty
from pathlib import Path

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String

from robotont_driver.protocol import crc16
from robotont_testing.harness import Master, wait_for

ROOT = Path(__file__).resolve().parents[1]

NODES = ("/driver_node", "/serial_com_node", "/odom_node")
PERIOD = 0.02     # [s] 50 Hz
SAMPLES = 1000    # latencies of each kind
BURST = 20000     # packets at 1000/s


def percentile(values, part):
    """The value below which `part` (0..1) of the values lie."""
    return sorted(values)[min(len(values) - 1, int(part * len(values)))]


class Port:
    """The board's end of a pseudo-terminal. `arrivals`: when bytes came."""

    def __init__(self, link):
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.symlink(os.ttyname(self._slave), str(link))
        self.arrivals = []
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self):
        while True:
            select.select([self.master], [], [])
            self.arrivals.append(time.monotonic())
            os.read(self.master, 4096)

    def write(self, data):
        """Write, and say when."""
        os.write(self.master, data)
        return time.monotonic()


def packet(number):
    """A checked packet of wheels that stand, with its counter."""
    body = b"0:0:0;%02X:0000:0000:0000:" % (number % 256)
    return body + b"%04X\n" % crc16(body)


def processor_time(pid):
    """[s] that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory(pid):
    """[MB] proportional set size."""
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) / 1000
    raise OSError(f"no Pss of process {pid}")


def row(name, value, unit, floor=None, bound="", note=""):
    """One line of the table."""
    return {"name": name, "value": value, "unit": unit, "floor": floor, "bound": bound, "note": note}


def latencies(sent, arrived):
    """[ms] each; one arrival for each sending, in order."""
    assert len(sent) == len(arrived), f"{len(sent)} sent, {len(arrived)} arrived"
    return [(end - start) * 1000 for start, end in zip(sent, arrived)]


def bench_pty():
    """[ms] from write to read of one packet on a bare pseudo-terminal, in one process."""
    master, slave = os.openpty()
    tty.setraw(slave)
    data, times = packet(0), []
    for _ in range(SAMPLES):
        start = time.monotonic()
        os.write(master, data)
        os.read(slave, 4096)
        times.append((time.monotonic() - start) * 1000)
    os.close(master)
    os.close(slave)
    return times


def bench_start():
    """[s] from the master's first answer to the first /odom, with one roslaunch that starts both."""
    with Master(start=False) as master:
        port = Port(master.folder / "board")
        feeding = threading.Event()
        threading.Thread(target=feed, args=(port, feeding), daemon=True).start()
        master.launch("robot.launch", f"port:={master.folder / 'board'}")
        master.wait()
        up = time.monotonic()
        first = threading.Event()
        rospy.init_node("bench", disable_signals=True)
        rospy.Subscriber("odom", rospy.AnyMsg, lambda _: first.set(), tcp_nodelay=True)
        assert first.wait(20), "no /odom"
        elapsed = time.monotonic() - up
        pids = [master.pid(name) for name in NODES]
        pss = [memory(pid) for pid in pids]  # here the nodes are alone, with no relay to share pages with
        feeding.set()
    return [
        row("start: master up to first /odom", elapsed, "s", bound="<= 1.5"),
        row("memory (PSS), three nodes without the relays", sum(pss), "MB", bound="<= 100", note=split(pss, ".0f")),
    ]


def feed(port, end):
    """Packets at 50 Hz until `end` is set."""
    number = 0
    while not end.wait(PERIOD):
        port.write(packet(number))
        number += 1


def split(values, form):
    """The values of the three nodes, in words."""
    return " + ".join(f"{name[1:]} {value:{form}}" for name, value in zip(NODES, values))


class Chains:
    """The driver and, beside it, relays that do nothing, in two chains with as many hops."""

    FLOORS = ("/floor1", "/floor2", "/floor3", "/floor4")

    def __init__(self, master):
        self.master = master
        self.port, self.floor_down, self.floor_up = (Port(master.folder / name) for name in ("ours", "down", "up"))
        master.launch("robot.launch", f"port:={master.folder / 'ours'}")
        self._relay("floor1", "twist_to_string", "~in:=/floor_cmd", "~out:=/floor_write")
        self._relay("floor2", "string_to_port", str(master.folder / "down"), "~in:=/floor_write")
        self._relay("floor3", "port_to_string", str(master.folder / "up"), "~out:=/floor_read")
        self._relay("floor4", "string_to_string", "~in:=/floor_read", "~out:=/floor_odom")
        rospy.init_node("bench", disable_signals=True)
        self.odom_times, self.floor_times = [], []
        for topic, times in (("odom", self.odom_times), ("floor_odom", self.floor_times)):
            rospy.Subscriber(topic, rospy.AnyMsg, lambda _, times=times: times.append(time.monotonic()),
                             tcp_nodelay=True)
        self.command = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        self.floor_command = rospy.Publisher("floor_cmd", Twist, queue_size=1)
        self.number = 0
        self.sent = {name: [] for name in ("feedback", "command", "floor feedback", "floor command")}
        self._due = 0.0
        wait_for(self._connected, "all nodes", period=0.05)
        self.pids = [master.pid(name) for name in NODES]
        self.floor_pids = [master.pid(name) for name in self.FLOORS]

    def _relay(self, name, *arguments):
        self.master.start(str(ROOT / "benchmarks" / "floor_node.py"), *arguments, f"__name:={name}")

    def _connected(self):
        self.port.write(self.next_packet())
        self.floor_up.write(packet(self.number))
        self.floor_command.publish(Twist())
        return self.odom_times and self.floor_times and self.floor_down.arrivals \
            and self.command.get_num_connections()

    def next_packet(self):
        """A packet whose counter follows."""
        self.number += 1
        return packet(self.number)

    def pause(self, duration):
        """Sleep until `duration` after the end of the last pause."""
        self._due += duration
        time.sleep(max(0.0, self._due - time.monotonic()))

    def cycle(self):
        """One period of 20 ms: a packet and a command through each of the chains, 5 ms apart."""
        twist = Twist()
        twist.linear.x = self.number % 2 * 0.1
        data = self.next_packet()
        self.sent["feedback"].append(self.port.write(data))
        self.pause(PERIOD / 4)
        self.sent["command"].append(time.monotonic())
        self.command.publish(twist)
        self.pause(PERIOD / 4)
        self.sent["floor feedback"].append(self.floor_up.write(data))
        self.pause(PERIOD / 4)
        self.sent["floor command"].append(time.monotonic())
        self.floor_command.publish(twist)
        self.pause(PERIOD / 4)

    def warm_up(self):
        """Until nothing is under way and driver_node no longer repeats (at 20 Hz, when nothing comes)."""
        self._due = time.monotonic()
        for _ in range(50):
            self.cycle()
        for times in (*self.sent.values(), self.odom_times, self.floor_times, self.port.arrivals,
                      self.floor_down.arrivals):
            times.clear()

    def bench_latency(self):
        """Rows of latency, processor time and memory at 50 Hz both ways."""
        self.warm_up()
        pids = self.pids + self.floor_pids
        before, begin = [processor_time(pid) for pid in pids], time.monotonic()
        for _ in range(SAMPLES):
            self.cycle()
        elapsed = time.monotonic() - begin
        used = [100 * (processor_time(pid) - old) / elapsed for pid, old in zip(pids, before)]
        rows = []
        for name, values, floor in (
            ("cmd_vel to first byte on the port", latencies(self.sent["command"], self.port.arrivals),
             latencies(self.sent["floor command"], self.floor_down.arrivals)),
            ("last byte of feedback to /odom", latencies(self.sent["feedback"], self.odom_times),
             latencies(self.sent["floor feedback"], self.floor_times)),
        ):
            rows += [
                row(f"{name}, p{100 * part:.0f}", percentile(values, part), "ms", percentile(floor, part),
                    f"<= {bound}, 2 x floor")
                for part, bound in ((0.5, 0.7), (0.99, 3.0))
            ]
        rows.append(row("processor, three nodes at 50 Hz both ways", sum(used[:3]), "% core", sum(used[3:]), "<= 8",
                        split(used[:3], ".1f") + "; floor: four relays"))
        pss = [memory(pid) for pid in self.pids]
        floor_pss = 3 * statistics.mean(memory(pid) for pid in self.floor_pids)
        rows.append(row("memory (PSS), three nodes", sum(pss), "MB", floor_pss, "<= 100",
                        split(pss, ".0f") + "; floor: three relays"))
        return rows

    def bench_throughput(self):
        """The row of packets at 1000/s."""
        reads = []
        rospy.Subscriber("serial_read", String, lambda message: reads.append(message.data), tcp_nodelay=True)
        wait_for(lambda: self.port.write(self.next_packet()) and reads, "serial_read", period=0.02)
        time.sleep(0.2)
        reads.clear()
        self._due = time.monotonic()
        for _ in range(BURST):
            self.port.write(self.next_packet())
            self.pause(0.001)
        wait_for(lambda: len(reads) >= BURST, "all packets of the burst")
        return [row("packets at 1000/s published", len(reads), f"of {BURST}", bound=f"= {BURST}")]


def bench_floor():
    """The rows of a bare pseudo-terminal."""
    times = bench_pty()
    return [row("bare pty, write to read, p50", percentile(times, 0.5), "ms"),
            row("bare pty, write to read, p99", percentile(times, 0.99), "ms")]


def bench_chains():
    """Rows of latency, processor time, memory and throughput."""
    with Master() as master:
        chains = Chains(master)
        return chains.bench_latency() + chains.bench_throughput()


PARTS = (bench_floor, bench_chains, bench_start)

"""The driver's latency, throughput, processor time, memory and start, each beside its floor."""

import os
import select
import statistics
import sys
import threading
import time
import tty
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "robotont_driver" / "test"))

from harness import Master, wait_for  # noqa: E402

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
    from robotont_driver.protocol import crc16  # the workspace is on the path only when this runs
    body = b"0:0:0;%02X:0000:0000:0000:" % (number % 256)
    return body + b"%04X\n" % crc16(body)


def processor_time(pid):
    """[s] that a process has used."""
    fields = Path("/proc/{}/stat".format(pid)).read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory(pid):
    """[MB] proportional set size."""
    for line in Path("/proc/{}/smaps_rollup".format(pid)).read_text().splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) / 1000
    raise OSError("no Pss of process {}".format(pid))


def row(name, value, unit, floor=None, bound="", note=""):
    """One line of the table."""
    return {"name": name, "value": value, "unit": unit, "floor": floor, "bound": bound, "note": note}


def latencies(sent, arrived):
    """[ms] each; one arrival for each sending, in order."""
    assert len(sent) == len(arrived), "{} sent, {} arrived".format(len(sent), len(arrived))
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
    import rospy
    from nav_msgs.msg import Odometry
    with Master(start=False) as master:
        port = Port(master.folder / "board")
        threading.Thread(target=feed, args=(port,), daemon=True).start()
        master.launch("robot.launch", "port:={}".format(master.folder / "board"))
        master.wait()
        up = time.monotonic()
        first = threading.Event()
        rospy.init_node("bench", disable_signals=True)
        rospy.Subscriber("odom", Odometry, lambda _: first.set(), tcp_nodelay=True)
        assert first.wait(20), "no /odom"
        return time.monotonic() - up


def feed(port):
    """Packets at 50 Hz, for ever."""
    number = 0
    while True:
        port.write(packet(number))
        number += 1
        time.sleep(PERIOD)


def bench_chains():
    """Rows of latency, processor time, memory and throughput."""
    import rospy
    from geometry_msgs.msg import Twist
    from nav_msgs.msg import Odometry
    from std_msgs.msg import String
    with Master() as master:
        ours, floor_down, floor_up = (Port(master.folder / name) for name in ("ours", "down", "up"))
        master.launch("robot.launch", "port:={}".format(master.folder / "ours"))
        node = str(ROOT / "benchmarks" / "floor_node.py")
        floors = ["/floor1", "/floor2", "/floor3", "/floor4"]
        master.start(node, "twist_to_string", "__name:=floor1", "~in:=/floor_cmd", "~out:=/floor_write")
        master.start(node, "string_to_port", str(master.folder / "down"), "__name:=floor2", "~in:=/floor_write")
        master.start(node, "port_to_string", str(master.folder / "up"), "__name:=floor3", "~out:=/floor_read")
        master.start(node, "string_to_string", "__name:=floor4", "~in:=/floor_read", "~out:=/floor_odom")
        rospy.init_node("bench", disable_signals=True)
        odom_times, floor_times, reads = [], [], []
        rospy.Subscriber("odom", rospy.AnyMsg, lambda _: odom_times.append(time.monotonic()), tcp_nodelay=True)
        rospy.Subscriber("floor_odom", String, lambda _: floor_times.append(time.monotonic()), tcp_nodelay=True)
        command = rospy.Publisher("cmd_vel", Twist, queue_size=1)
        floor_command = rospy.Publisher("floor_cmd", Twist, queue_size=1)
        number = 0

        def connected():
            nonlocal number
            number += 1
            ours.write(packet(number))
            floor_up.write(packet(number))
            floor_command.publish(Twist())
            time.sleep(0.05)
            return odom_times and floor_times and floor_down.arrivals and command.get_num_connections()

        wait_for(connected, "all nodes", period=0)
        pids = [master.pid(name) for name in NODES]
        floor_pids = [master.pid(name) for name in floors]
        time.sleep(1.0)
        # driver_node repeats at 20 Hz while nothing comes; at 50 Hz only the commands go out
        step = PERIOD / 4
        twist = Twist()
        sent = {name: [] for name in ("feedback", "command", "floor feedback", "floor command")}
        due = time.monotonic()

        def pause():
            nonlocal due
            due += step
            time.sleep(max(0.0, due - time.monotonic()))

        def cycle():
            nonlocal number
            number += 1
            sent["feedback"].append(ours.write(packet(number)))
            pause()
            twist.linear.x = number % 2 * 0.1
            sent["command"].append(time.monotonic())
            command.publish(twist)
            pause()
            sent["floor feedback"].append(floor_up.write(packet(number)))
            pause()
            sent["floor command"].append(time.monotonic())
            floor_command.publish(twist)
            pause()

        for _ in range(20):  # warm up, and let the 20 Hz repetition fall silent
            cycle()
        pause()
        for times in (*sent.values(), odom_times, floor_times, ours.arrivals, floor_down.arrivals):
            times.clear()
        before = [processor_time(pid) for pid in pids + floor_pids]
        begin = time.monotonic()
        for _ in range(SAMPLES):
            cycle()
        elapsed = time.monotonic() - begin
        used = [100 * (processor_time(pid) - old) / elapsed for pid, old in zip(pids + floor_pids, before)]
        feedback = latencies(sent["feedback"], odom_times)
        commands = latencies(sent["command"], ours.arrivals)
        floor_feedback = latencies(sent["floor feedback"], floor_times)
        floor_commands = latencies(sent["floor command"], floor_down.arrivals)
        pss = [memory(pid) for pid in pids]
        floor_pss = statistics.mean(memory(pid) for pid in floor_pids)

        rospy.Subscriber("serial_read", String, lambda message: reads.append(message.data), tcp_nodelay=True)

        def reading():
            nonlocal number
            number += 1
            ours.write(packet(number))
            time.sleep(0.02)
            return reads
        wait_for(reading, "serial_read", period=0)
        time.sleep(0.2)
        reads.clear()
        due = time.monotonic()
        for _ in range(BURST):
            number += 1
            ours.write(packet(number))
            due += 0.001
            time.sleep(max(0.0, due - time.monotonic()))
        wait_for(lambda: len(reads) >= BURST, "all packets of the burst")

    rows = []
    for name, values, floor in (("cmd_vel to first byte on the port", commands, floor_commands),
                                ("last byte of feedback to /odom", feedback, floor_feedback)):
        for part, bound in ((0.5, 0.7), (0.99, 3.0)):
            rows.append(row("{}, p{:.0f}".format(name, 100 * part), percentile(values, part), "ms",
                            percentile(floor, part), "<= {} ms and 2.0 x floor".format(bound)))
    rows.append(row("processor, three nodes at 50 Hz both ways", sum(used[:3]), "% of a core", sum(used[3:]),
                    "<= 8", " + ".join("{} {:.1f}".format(n[1:], u) for n, u in zip(NODES, used))
                    + "; floor: four relays"))
    rows.append(row("memory (PSS), three nodes", sum(pss), "MB", 3 * floor_pss, "<= 100",
                    " + ".join("{} {:.0f}".format(n[1:], m) for n, m in zip(NODES, pss))
                    + "; floor: three relays"))
    rows.append(row("packets at 1000/s published", len(reads), "of {}".format(BURST), None, "= {}".format(BURST)))
    return rows


def run():
    """All rows of the driver."""
    pty = bench_pty()
    rows = [row("bare pty, write to read, p50", percentile(pty, 0.5), "ms"),
            row("bare pty, write to read, p99", percentile(pty, 0.99), "ms")]
    return rows + bench_chains()

"""The firmware and the driver's serial_com_node talk over a pseudo-terminal: no packet may be lost.

FIRMWARE_LOOP_SECONDS sets how long (default 10). How even the periods are is printed, not judged: it is this machine's
doing, not the board's.
"""

import ast
import os
import re
import subprocess
import sys

from firmware_pty import Firmware, jitter

from robotont_testing.harness import Master
from robotont_testing.robots import WHEEL_PARAMS

SECONDS = float(os.environ.get("FIRMWARE_LOOP_SECONDS", "10"))
PROGRAM = """
import sys, time, threading, rospy
from std_msgs.msg import String
from diagnostic_msgs.msg import DiagnosticArray

rospy.init_node("listener")
counts, state = [], {}

def on_packet(message):
    counts.append([int(count) for count in message.data.split(";")[0].split(":")])

def health(message):
    for status in message.status:
        state.update((value.key, value.value) for value in status.values)

rospy.Subscriber("serial_read", String, on_packet, queue_size=100, tcp_nodelay=True)
rospy.Subscriber("diagnostics", DiagnosticArray, health)
publisher = rospy.Publisher("serial_write", String, queue_size=1, tcp_nodelay=True)
while not publisher.get_num_connections():
    time.sleep(0.01)
print("ready", flush=True)
stop = threading.Event()
threading.Thread(target=lambda: (sys.stdin.read(), stop.set()), daemon=True).start()
while not stop.wait(0.05):
    publisher.publish("-18.90:5.25:30.00;\\n")
end = time.monotonic() + 5
state.clear()
while "packets read" not in state and time.monotonic() < end:
    time.sleep(0.01)
print(repr((counts, state)), flush=True)
"""


def talk():
    """Return (periods, the firmware's output, counts, diagnostics) of one conversation."""
    periods = round(SECONDS * 50)
    with Master() as master, Firmware(periods) as firmware:
        subprocess.run(
            ["rosparam", "load", str(WHEEL_PARAMS)], check=True, timeout=30
        )
        master.node("serial_com_node", "_port:=" + firmware.port)
        listener = subprocess.Popen(
            [sys.executable, "-c", PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            universal_newlines=True,
        )
        try:
            assert listener.stdout.readline() == "ready\n"
            output = firmware.start().finish()
            answer, _ = listener.communicate(timeout=20)  # closes its input: it stops
        finally:
            listener.kill()
            listener.wait()
    return (periods, output, *ast.literal_eval(answer))


def test_talks_with_serial_com_node_and_loses_nothing():
    periods, output, counts, health = talk()
    missed = int(re.search(r"^missed ticks (\d+)$", output, flags=re.MULTILINE).group(1))
    unseen = missed - int(health["ticks missed"])  # before the first packet, where the computer was slow to start
    assert abs(len(counts) + unseen - periods) <= 2, health
    assert health["packets"] == "checked"
    assert health["lines dropped"] == health["commands refused"] == "0", health
    assert health["periods repaired"] == health["ticks missed"], health  # some, where this machine is too busy
    assert health["board"].startswith("robotont_firmware "), health
    assert health["board's newest messages"] == health["board"], "the banner alone"
    for wheel, wished in enumerate((-18.9, 5.25, 30.0)):
        steady = [count[wheel] for count in counts[100:]]
        assert abs(sum(steady) / len(steady) - wished) < 0.03
    print(f"{len(counts)} packets, p99 of the period within {1000 * jitter(output):.2f} ms")

"""The firmware and the driver's serial_com_node talk over a pseudo-terminal: no packet may be lost.

FIRMWARE_LOOP_SECONDS sets how long (default 10). Needs ROS 1; everywhere else it is skipped.
"""

import os
import subprocess
import sys
import threading
import time

import pytest
from firmware_pty import Firmware, jitter
from firmware_tools import ROOT

rospy = pytest.importorskip("rospy", reason="needs ROS 1")

SECONDS = float(os.environ.get("FIRMWARE_LOOP_SECONDS", "10"))
ATTEMPTS = 3  # the bound on the period needs a machine that has time; the rest must hold at once
PROGRAM = '''
import sys, time, threading, rospy
from std_msgs.msg import String
from diagnostic_msgs.msg import DiagnosticArray

rospy.init_node("listener")
times, counts, state = [], [], {}

def heard(message):
    times.append(time.monotonic())
    counts.append([int(count) for count in message.data.split(";")[0].split(":")])

def health(message):
    for status in message.status:
        state.update((value.key, value.value) for value in status.values)

rospy.Subscriber("serial_read", String, heard, queue_size=100, tcp_nodelay=True)
rospy.Subscriber("diagnostics", DiagnosticArray, health)
publisher = rospy.Publisher("serial_write", String, queue_size=1, tcp_nodelay=True)
while not publisher.get_num_connections():
    time.sleep(0.01)
print("ready", flush=True)
stop = threading.Event()
threading.Thread(target=lambda: (sys.stdin.read(), stop.set()), daemon=True).start()
while not stop.wait(0.05):
    publisher.publish("-18.90:5.25:30.00;\\n")
asked = len(state)
end = time.monotonic() + 5
state.clear()
while "packets read" not in state and time.monotonic() < end:
    time.sleep(0.01)
print(repr((times, counts, state)), flush=True)
'''


def environment():
    sys.path.insert(0, str(ROOT / "robotont_driver" / "test"))
    try:
        import harness  # noqa: PLC0415
    finally:
        sys.path.pop(0)
    return harness


def talk():
    harness = environment()
    periods = round((SECONDS + 1) * 50)
    python_path = os.pathsep.join([str(ROOT / "robotont_driver" / "src"), os.environ.get("PYTHONPATH", "")])
    with harness_master(harness) as master:
        env = dict(os.environ, PYTHONPATH=python_path)
        subprocess.run(
            ["rosparam", "load", str(ROOT / "config" / "wheel_params.yaml")], check=True, env=env, timeout=20
        )
        listener = subprocess.Popen(
            [sys.executable, "-c", PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=env,
            universal_newlines=True,
        )  # fmt: skip
        with Firmware(periods) as firmware:
            try:
                node = ROOT / "robotont_driver" / "scripts" / "serial_com_node"
                master.start(sys.executable, node, "_port:=" + firmware.port, PYTHONPATH=python_path)
                assert listener.stdout.readline() == "ready\n"
                firmware.finish()
                answer, _ = listener.communicate(timeout=20)
            finally:
                listener.kill()
                listener.wait()
    return periods, answer

"""The simulator's speed without a clock, and its share of a core in real time, beside the bare physics."""

import time

import mujoco
import rospy
from subjects import processor_time

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_simulator.lockstep import LockstepRun
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import read_world
from robotont_testing import places
from robotont_testing.figures import row
from robotont_testing.harness import Master, wait_for
from robotont_testing.robots import SHIPPED

SECONDS = 20.0  # [s]


def bench_fast(_options):
    """Row of simulated seconds per second; the floor is MuJoCo alone."""
    run = LockstepRun(Simulation(read_wheels(SHIPPED), read_world(places.config("worlds/empty.yaml")), seed=1))
    run.hold((0.0, 0.0, 0.0), 0.4)
    begin = time.perf_counter()
    run.hold((0.3, 0.1, 0.5), SECONDS)
    fast = SECONDS / (time.perf_counter() - begin)
    simulation = run.simulation
    steps = round(SECONDS / simulation.mujoco_model.opt.timestep)
    begin = time.perf_counter()
    mujoco.mj_step(simulation.mujoco_model, simulation.data, steps)
    return [row("simulator without a clock", fast, "x real time", SECONDS / (time.perf_counter() - begin), ">= 10",
                "floor: MuJoCo alone")]


def bench_real_time(_options):
    """Row of the simulator's processor time in real time, the scan included."""
    with Master() as master:
        master.launch("simulation.launch", f"port:={master.folder / 'board'}", "world:=room")
        rospy.init_node("bench", disable_signals=True)
        seen = []
        rospy.Subscriber("ground_truth/odom", rospy.AnyMsg, seen.append)
        wait_for(lambda: len(seen) > 50, "the simulator")
        pid = master.pid("/simulator_node")
        before, begin, first = processor_time(pid), time.monotonic(), len(seen)
        time.sleep(SECONDS)
        elapsed = time.monotonic() - begin
        share = 100 * (processor_time(pid) - before) / elapsed
        rate = (len(seen) - first) / elapsed
    return [row("simulator in real time", share, "% core", None, "<= 40", f"{rate:.2f} periods/s of 50")]


PARTS = (bench_fast, bench_real_time)

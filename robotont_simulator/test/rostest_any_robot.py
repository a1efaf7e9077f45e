#!/usr/bin/env python3
"""Robots of test_sim_any_robot as simulation.launch robot:=FOLDER: refused with words, or driven and stopped."""

import math

import rostest
from any_robot import SILENCE, ZEROS, draw
from simulation_test import SimulationTest

from robotont_driver.kinematics.wheel_params import no_load_speeds, read_wheels
from robotont_simulator.simulated_board import configuration
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World
from robotont_testing.harness import Processes, wait_for
from robotont_testing.robots import SHIPPED, robot_folder

SEEDS = range(0, 24, 2)  # those with encoders as told


class AnyRobotTest(SimulationTest):
    def test_refused_or_driven_as_commanded_and_stopped(self):
        for seed in SEEDS:
            with self.subTest(seed=seed), Processes() as processes:
                self.stop_simulation()
                case = draw(seed)
                keys = {**SHIPPED, "encoderEdgesPerMotorRevolution": case.edges, "pidControlFrequency": case.rate,
                        "gearboxReductionRatio": case.gear}
                folder, wheels = robot_folder(processes.folder / "robot", keys), read_wheels(keys)
                try:
                    configuration(wheels, *Simulation(wheels, World()).inertia)
                except ValueError:
                    self.refused(folder)
                else:
                    self.start("robot:=" + folder)
                    self.driven(min(0.3, 0.8 * min(no_load_speeds(wheels))))

    def refused(self, folder):
        with Processes() as processes:
            log = processes.folder / "log"
            port = processes.folder / "board"
            launch = processes.launch("simulation.launch", "robot:=" + folder, f"port:={port}", log=log)
            wait_for(lambda: "cannot drive this robot" in log.read_text(), "words", timeout=60)
            wait_for(lambda: launch.poll() is not None, "the end", timeout=60)

    def driven(self, speed):
        for zeros in (True, False):
            first = len(self.truth)
            self.drive((speed, 0.0, 0.0), lambda first=first: self.since(first) > 3.0, "three seconds of driving")
            speeds = [self.speed(message) for message in self.truth[first:]]
            self.assertLess(max(speeds), 1.1 * speed)
            self.assertAlmostEqual(sum(speeds[-50:]) / len(speeds[-50:]), speed, delta=0.1 * speed)
            first = len(self.truth)
            if zeros:
                self.drive((0.0, 0.0, 0.0), lambda first=first: self.since(first) > 2.5, "the stop")
            else:
                wait_for(lambda first=first: self.since(first) > 2.5, "the stop without commands")
            begun = self.truth[first].header.stamp.to_sec()
            stands = max((message.header.stamp.to_sec() - begun for message in self.truth[first:]
                          if self.speed(message) > 0.02), default=0.0)
            self.assertLess(stands, (ZEROS if zeros else SILENCE)[0])

    def since(self, first):
        """[s] of the simulation since the message of that number."""
        stamps = [message.header.stamp.to_sec() for message in (self.truth[first:first + 1] + self.truth[-1:])]
        return stamps[-1] - stamps[0]

    @staticmethod
    def speed(message):
        return math.hypot(message.twist.twist.linear.x, message.twist.twist.linear.y)


if __name__ == "__main__":
    rostest.rosrun("robotont_simulator", "any_robot_test", AnyRobotTest)

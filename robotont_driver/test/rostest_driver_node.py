#!/usr/bin/env python3
"""driver_node beside mock_serial_node."""

import math
import signal
import time

import rospy
import rostest
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from robotont_testing.harness import suspended, wait_for
from robotont_testing.node_test import OK, WARN, NodeTest, twist
from robotont_testing.robots import WHEEL_PARAMS

TASK = "driver_node: command stream"
ZEROS = "0.00:0.00:0.00;\n"
FORWARD = "-18.90:0.00:18.90;\n"
BACKWARD = "18.90:0.00:-18.90;\n"


class DriverNodeTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.written = self.listen("serial_write", String)
        self.command = self.publisher("cmd_vel", Twist)
        wait_for(lambda: self.packets() and self.packets()[-1] == ZEROS, "a robot at rest")

    def packets(self):
        return [message.data for message in self.written]

    def wait_for_packet(self, packet):
        """Wait for a packet that comes from now on."""
        before = len(self.written)
        wait_for(lambda: packet in self.packets()[before:], repr(packet))

    def drive(self, *speeds, packet):
        before = len(self.written)
        self.command.publish(twist(*speeds))
        wait_for(lambda: packet in self.packets()[before:], repr(packet))

    def test_worked_values_of_the_shipped_file(self):
        self.drive(0.2, 0, 0, packet=FORWARD)
        self.drive(0, 0.2, 0, packet="-10.91:21.83:-10.91;\n")
        self.drive(0, 0, 1, packet="-13.64:-13.64:-13.64;\n")

    def test_worked_values_of_the_thesis_seven_keys(self):
        written = self.listen("/bare/serial_write", String)
        command = self.publisher("/bare/cmd_vel", Twist)
        for speeds, packet in (((0.2, 0, 0), "10.91:-21.83:10.91;\n"), ((0, 0, 1), "13.64:13.64:13.64;\n")):
            command.publish(twist(*speeds))
            wait_for(lambda packet=packet: any(message.data == packet for message in written), repr(packet))

    def test_limits_keep_the_direction_and_decimals_can_be_left_out(self):
        written = self.listen("/limited/serial_write", String)
        command = self.publisher("/limited/cmd_vel", Twist)
        command.publish(twist(3.0, 0, 0))
        wait_for(lambda: any(message.data == "-9:0:9;\n" for message in written), "the limited packet")
        task = "limited/driver_node: command stream"
        wait_for(lambda: command.publish(twist(3.0, 0, 0)) or (self.values(task)["newest command limited"] == "True"
                                                               and self.status[task].level == OK),
                 "word of the limit, and no complaint", period=0.1)

    def test_the_newest_command_is_repeated_then_times_out_and_a_new_one_drives_again(self):
        before = len(self.written)
        self.drive(0.2, 0, 0, packet=FORWARD)
        wait_for(lambda: self.packets()[-1] == ZEROS, "the stop")
        assert self.packets()[before:].count(FORWARD) >= 5  # 20 Hz for 0.5 s
        self.wait_for_status(TASK, WARN, "is their sender alive?")
        self.drive(0.2, 0, 0, packet=FORWARD)
        self.command.publish(twist())
        self.wait_for_status(TASK, OK)

    def test_a_killed_publisher(self):
        publisher = self.processes.start(
            "rostopic", "pub", "-r", "20", "/cmd_vel", "geometry_msgs/Twist", "{linear: {x: 0.2}}")
        wait_for(lambda: self.packets().count(FORWARD) > 20, "commands")
        self.processes.stop(publisher, signal.SIGKILL)
        self.wait_for_packet(ZEROS)
        self.wait_for_status(TASK, WARN, "is their sender alive?")

    def test_what_the_base_cannot_do_stops_it(self):
        for value in (math.nan, math.inf, -math.inf):
            for x, y, turn in ((value, 0, 0), (0, value, 0), (0, 0, value)):
                self.drive(0.2, 0, 0, packet=FORWARD)
                self.drive(x, y, turn, packet=ZEROS)
        self.wait_for_status(TASK, WARN, "refused")
        flying = twist(0.2)
        flying.linear.z = 1.0
        self.drive(0.2, 0, 0, packet=FORWARD)
        before = len(self.written)
        self.command.publish(flying)
        wait_for(lambda: ZEROS in self.packets()[before:], "the stop")
        self.wait_for_status(TASK, WARN, "linear.z is 1")
        assert "nan" not in "".join(self.packets())
        assert "inf" not in "".join(self.packets())

    def test_emergency_stop(self):
        button = self.publisher("emergency_stop", Bool)
        self.drive(0.2, 0, 0, packet=FORWARD)
        button.publish(True)
        wait_for(lambda: self.packets()[-1] == ZEROS, "the stop")
        self.wait_for_status(TASK, WARN, "emergency stop")
        before = len(self.written)
        self.command.publish(twist(0.2))
        wait_for(lambda: len(self.written) > before + 3, "repetitions")
        assert set(self.packets()[before:]) == {ZEROS}
        button.publish(False)
        self.wait_for_status(TASK, OK)
        assert set(self.packets()[before:]) == {ZEROS}
        self.let_go_and_drive(self.command, lambda: self.packets()[-1] != ZEROS)
        self.command.publish(twist())

    def test_whoever_still_asks_for_motion_at_a_release_has_to_stop_first(self):
        button = self.publisher("emergency_stop", Bool)
        self.drive(0.2, 0, 0, packet=FORWARD)
        button.publish(True)
        wait_for(lambda: self.packets()[-1] == ZEROS, "the stop")
        before = len(self.written)
        self.command.publish(twist(0.2))
        button.publish(False)
        wait_for(lambda: self.command.publish(twist(0.2)) or
                 (TASK in self.status and "must stop once" in self.status[TASK].message), "word of it", period=0.05)
        assert set(self.packets()[before:]) == {ZEROS}
        self.let_go_and_drive(self.command, lambda: self.packets()[-1] != ZEROS)
        self.command.publish(twist())

    def test_the_false_of_others_and_a_latched_one_release_nothing_and_a_person_does(self):
        stops = self.listen("emergency_stop/pressed_by", String, publishers=1)
        mine = self.publisher("emergency_stop", Bool)
        latched = self.processes.start("rostopic", "pub", "/emergency_stop", "std_msgs/Bool", "data: true")
        wait_for(lambda: stops and stops[-1].data.startswith("/rostopic_"), "the press of rostopic")
        mine.publish(False)
        self.processes.start("rostopic", "pub", "/emergency_stop", "std_msgs/Bool", "data: false")
        self.processes.start("rostopic", "pub", "-r", "50", "/emergency_stop", "std_msgs/Bool", "data: false")
        self.processes.stop(latched, signal.SIGKILL)
        mine.publish(True)
        wait_for(lambda: rospy.get_name() in stops[-1].data, "two that press")
        mine.publish(False)
        wait_for(lambda: rospy.get_name() not in stops[-1].data, "its own release")
        self.wait_for_status(TASK, WARN, "emergency stop")
        assert stops[-1].data.startswith("/rostopic_")
        release = rospy.ServiceProxy("emergency_stop/release", Trigger)
        answers = []
        wait_for(lambda: answers.append(release()) or answers[-1].success, "the release", period=0.1)  # else ask again
        assert "/rostopic_" in answers[-1].message
        wait_for(lambda: stops[-1].data == "", "the release")
        self.let_go_and_drive(self.command, lambda: self.packets()[-1] != ZEROS)
        self.command.publish(twist())

    def start_node(self, namespace, log=None):
        """(process, list of packets) of a driver_node in a namespace of its own."""
        self.processes.start("rosparam", "load", WHEEL_PARAMS, namespace).wait()
        written = self.listen(namespace + "/serial_write", String)
        node = self.start_driver("driver_node", namespace, log)
        wait_for(lambda: written, "packets")
        return node, written

    def test_repeated_releases_of_a_button_that_is_not_pressed_do_not_stop(self):
        button = self.publisher("emergency_stop", Bool)
        self.drive(0.2, 0, 0, packet=FORWARD)
        before = len(self.written)
        for _ in range(10):
            button.publish(False)
            self.command.publish(twist(0.2))
            self.wait_for_packet(FORWARD)
        assert ZEROS not in self.packets()[before:]
        self.command.publish(twist())

    def test_a_button_that_repeats_itself_is_told_once(self):
        log = self.processes.folder / "log"
        _, written = self.start_node("/repeated", log)
        button = self.publisher("/repeated/emergency_stop", Bool)
        for pressed in (True, False):
            before = len(written)
            wait_for(lambda pressed=pressed, before=before: button.publish(pressed) or len(written) > before + 20,
                     "a second of it", period=0.02)
        told = [line for line in log.read_text().splitlines() if "emergency stop" in line]
        assert len(told) == 2, told

    def test_an_emergency_stop_survives_a_restart(self):
        node, written = self.start_node("/restarted")
        button = self.publisher("/restarted/emergency_stop", Bool)
        command = self.publisher("/restarted/cmd_vel", Twist)
        button.publish(True)
        self.wait_for_status("restarted/" + TASK, WARN, "emergency stop")
        wait_for(lambda: rospy.get_param("/restarted/emergency_stop_pressed", []), "the parameter")
        self.processes.stop(node, signal.SIGKILL)
        wait_for(lambda: not command.get_num_connections(), "the end of the node")
        self.start_node("/restarted")
        wait_for(command.get_num_connections, "the new node")
        del written[:]
        wait_for(lambda: command.publish(twist(0.2)) or len(written) > 20, "packets", period=0.05)
        assert {message.data for message in written} == {ZEROS}
        assert self.values("restarted/" + TASK)["emergency stop"] == rospy.get_name()
        wait_for(button.get_num_connections, "the button's connection")
        button.publish(False)
        wait_for(lambda: command.publish(twist(0.2)) or
                 "must stop once" in self.status["restarted/" + TASK].message, "word of it", period=0.05)
        self.let_go_and_drive(command, lambda: written[-1].data != ZEROS)

    def test_commands_that_waited_while_the_node_was_stopped_do_not_drive(self):
        node, written = self.start_node("/stalled")
        command = self.publisher("/stalled/cmd_vel", Twist)
        wait_for(lambda: command.publish(twist(0.2)) or written[-1].data == FORWARD, "a driving robot")
        pid = self.processes.pid("/stalled/driver_node")
        with suspended(pid):
            end = time.monotonic() + 1.0  # longer than ~cmd_timeout
            while time.monotonic() < end:
                command.publish(twist(-0.2))
                time.sleep(0.02)
            del written[:]
        wait_for(lambda: len(written) > 20, "packets after the stop")
        packets = [message.data for message in written]
        assert BACKWARD not in packets
        assert set(packets[1:]) == {ZEROS}  # the first may have been under way already
        wait_for(lambda: command.publish(twist(0.2)) or written[-1].data == FORWARD, "a new command drives")
        self.processes.stop(node)

    def test_a_latched_command_of_unknown_age_does_not_drive_a_node_that_starts(self):
        latched = rospy.Publisher("/latched/cmd_vel", Twist, queue_size=1, latch=True)
        self.addCleanup(latched.unregister)
        latched.publish(twist(0.2))
        _, written = self.start_node("/latched")
        wait_for(latched.get_num_connections, "the connection")
        self.wait_for_status("latched/" + TASK, OK)
        assert {message.data for message in written} == {ZEROS}
        latched.publish(twist(0.2))
        wait_for(lambda: written[-1].data == FORWARD, "a command that is published now")

    def test_the_last_packet_is_zeros_however_the_node_ends(self):
        for how in (signal.SIGINT, signal.SIGTERM):
            self.processes.start("rosparam", "load", WHEEL_PARAMS, "/ending").wait()
            node = self.start_driver("driver_node", "/ending")
            written = self.listen("/ending/serial_write", String)
            command = self.publisher("/ending/cmd_vel", Twist)
            wait_for(lambda command=command, written=written: command.publish(twist(0.2)) or (
                written and written[-1].data == FORWARD), "a driving robot")
            self.processes.stop(node, how)
            wait_for(lambda written=written: written[-1].data == ZEROS, "zeros at the end")

    def test_mock_serial_node_answers_each_packet_with_whole_counts(self):
        read = self.listen("serial_read", String)
        before = len(self.written)
        wait_for(lambda: len(read) > 3, "packets")
        for _ in range(10):
            self.command.publish(twist(0.2))
            self.wait_for_packet(FORWARD)
        self.command.publish(twist())
        wait_for(lambda: self.packets()[-1] == ZEROS, "the end")
        driven = sum(float(packet.rstrip(";\n").split(":")[2]) for packet in self.packets()[before:])
        counts = [[int(count) for count in message.data.rstrip(";\n").split(":")] for message in read]
        wait_for(lambda: abs(sum(int(message.data.rstrip(";\n").split(":")[2]) for message in read) - driven) <= 1,
                 f"the counts to add up to {driven:.2f}")
        assert all(len(count) == 3 for count in counts)


if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "driver_node_test", DriverNodeTest)

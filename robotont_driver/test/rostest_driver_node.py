#!/usr/bin/env python3
"""driver_node."""

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


class DriverNodeTest(NodeTest):
    def setUp(self):
        super().setUp()
        self.written = self.packets_on("serial_write")
        self.command = self.publisher("cmd_vel", Twist)
        wait_for(lambda: self.written[-1:] == [ZEROS], "a robot at rest")

    def packets_on(self, topic):
        """The list of packets, as text, that have come and will come."""
        packets = []
        self.listen(topic, String, lambda message: packets.append(message.data))
        return packets

    def drive(self, *speeds, packet):
        """Command once, and wait for a packet that comes from now on."""
        before = len(self.written)
        self.command.publish(twist(*speeds))
        wait_for(lambda: packet in self.written[before:], repr(packet))

    def start_node(self, namespace, *arguments, log=None):
        """(process, its packets) of a driver_node in a namespace of its own."""
        self.processes.load(WHEEL_PARAMS, namespace)
        written = self.packets_on(namespace + "/serial_write")
        node = self.processes.node("driver_node", f"__ns:={namespace}", *arguments, log=log)
        wait_for(lambda: written, "packets")
        return node, written

    def test_the_newest_command_is_repeated_then_times_out_and_a_new_one_drives_again(self):
        before = len(self.written)
        self.drive(0, 0.2, 0, packet="-10.91:21.83:-10.91;\n")
        self.drive(0.2, 0, 0, packet=FORWARD)
        wait_for(lambda: self.written[-1] == ZEROS, "the stop")
        forward = [packet for packet in self.written[before:] if packet == FORWARD]
        assert len(forward) >= 5  # 20 Hz for 0.5 s
        self.wait_for_status(TASK, WARN, "is their sender alive?")
        self.drive(0.2, 0, 0, packet=FORWARD)
        self.command.publish(twist())
        self.wait_for_status(TASK, OK, "no cmd_vel for")  # a zero ends the complaint, too

    def test_each_command_goes_out_at_once(self):
        _, written = self.start_node("/left", "_cmd_timeout:=2.0", "_publish_rate:=10.0")
        command = self.publisher("/left/cmd_vel", Twist)
        wait_for(lambda: command.publish(twist(0.2)) or written[-1] == FORWARD, "motion", period=0.05)
        begun = time.monotonic()
        for _ in range(40):
            before = len(written)
            command.publish(twist(0.2))
            wait_for(lambda before=before: len(written) > before, "a packet", period=0.005)
        assert time.monotonic() - begun < 2.0, "repetitions alone take 4 s"

    def test_the_false_of_others_and_a_latched_one_release_nothing_and_a_person_does(self):
        stops = self.listen("emergency_stop/pressed_by", String, publishers=1)
        mine = self.publisher("emergency_stop", Bool)
        latched = self.processes.start("rostopic", "pub", "/emergency_stop", "std_msgs/Bool", "data: true")
        self.drive(0.2, 0, 0, packet=FORWARD)
        wait_for(lambda: stops and stops[-1].data.startswith("/rostopic_"), "the press of rostopic")
        wait_for(lambda: self.written[-1] == ZEROS, "the stop")
        before = len(self.written)
        self.processes.stop(latched, signal.SIGKILL)
        self.processes.start("rostopic", "pub", "/emergency_stop", "std_msgs/Bool", "data: false")
        mine.publish(True)
        wait_for(lambda: rospy.get_name() in stops[-1].data, "two that press")
        mine.publish(False)
        wait_for(lambda: rospy.get_name() not in stops[-1].data, "its own release")
        wait_for(lambda: self.command.publish(twist(0.2)) or len(self.written) > before + 20, "packets", period=0.05)
        self.wait_for_status(TASK, WARN, "emergency stop")
        assert stops[-1].data.startswith("/rostopic_")
        late = rospy.ServiceProxy("emergency_stop/release", Trigger, headers={"seen": f"{rospy.get_name()}, /other"})()
        assert (late.success, late.message.startswith("not released: ")) == (False, True), late
        release = rospy.ServiceProxy("emergency_stop/release", Trigger, headers={"seen": stops[-1].data})
        answers = []
        wait_for(lambda: answers.append(release()) or answers[-1].success, "the release", period=0.1)  # else ask again
        assert "/rostopic_" in answers[-1].message
        wait_for(lambda: stops[-1].data == "", "the release")
        wait_for(lambda: self.command.publish(twist(0.2)) or "must stop once" in self.status[TASK].message,
                 "word of it", period=0.05)
        assert set(self.written[before:]) == {ZEROS}
        self.let_go_and_drive(self.command, lambda: self.written[-1] != ZEROS)
        self.command.publish(twist())

    def test_an_emergency_stop_is_told_once_and_survives_a_restart(self):
        log = self.processes.folder / "log"
        node, written = self.start_node("/restarted", log=log)
        button = self.publisher("/restarted/emergency_stop", Bool)
        command = self.publisher("/restarted/cmd_vel", Twist)
        wait_for(lambda: button.publish(True) or len(written) > 20, "a second of it", period=0.02)
        self.wait_for_status("restarted/" + TASK, WARN, "emergency stop")
        wait_for(lambda: rospy.get_param("/restarted/emergency_stop_pressed", []), "the parameter")
        told = [line for line in log.read_text().splitlines() if "emergency stop" in line]
        assert len(told) == 1, told
        self.processes.stop(node, signal.SIGKILL)
        wait_for(lambda: not command.get_num_connections(), "the end of the node")
        self.start_node("/restarted")
        wait_for(command.get_num_connections, "the new node")
        del written[:]
        wait_for(lambda: command.publish(twist(0.2)) or len(written) > 20, "packets", period=0.05)
        assert set(written) == {ZEROS}
        assert self.values("restarted/" + TASK)["emergency stop"] == rospy.get_name()

    def test_age_limits_decimals_and_the_end(self):
        """One node for what needs one of its own: a latched command, a stopped process, parameters, SIGTERM."""
        latched = rospy.Publisher("/other/cmd_vel", Twist, queue_size=1, latch=True)
        self.addCleanup(latched.unregister)
        latched.publish(twist(0.2))
        node, written = self.start_node("/other", "_command_decimals:=0", "_max_linear_speed:=0.1")
        task = "other/" + TASK
        zeros, forward = "0:0:0;\n", "-9:0:9;\n"

        def newest_drives():
            latched.publish(twist(3.0))
            return written[-1] == forward
        wait_for(latched.get_num_connections, "the connection")
        self.wait_for_status(task, OK)
        assert set(written) == {zeros}  # the latched command may be of any age
        wait_for(newest_drives, "a command that is published now, limited")
        wait_for(lambda: newest_drives() and self.values(task)["newest command limited"] == "yes" and
                 self.status[task].level == OK, "word of the limit, and no complaint", period=0.1)
        with suspended(self.processes.pid("/other/driver_node")):
            end = time.monotonic() + 1.0  # longer than ~cmd_timeout
            while time.monotonic() < end:
                latched.publish(twist(-0.2))
                time.sleep(0.02)
            del written[:]
        wait_for(lambda: len(written) > 20, "packets after the stop")
        assert "9:0:-9;\n" not in written
        assert set(written[1:]) == {zeros}  # the first may have been under way already
        wait_for(newest_drives, "a new command drives")
        self.processes.stop(node, signal.SIGTERM)
        wait_for(lambda: written[-1] == zeros, "zeros at the end")

if __name__ == "__main__":
    rostest.rosrun("robotont_driver", "driver_node_test", DriverNodeTest)

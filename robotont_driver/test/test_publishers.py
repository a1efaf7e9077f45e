"""Who connects to a node is heard: while its publisher is made, beside strangers and who hangs."""

import contextlib
import socket
import struct
import sys
import time
from unittest import mock

from rospy.impl.tcpros_base import get_tcpros_server_address
from rospy.topics import _PublisherImpl
from std_msgs.msg import String

from robotont_driver.ros.publishers import DroppingPublisher
from robotont_driver.ros.rospy_end import init_tool
from robotont_testing.harness import Master, in_own_process, wait_for

SUBSCRIBER = """import rospy
from std_msgs.msg import String
rospy.init_node("listener")
rospy.Subscriber("words", String, lambda message: print(message.data, flush=True))
rospy.spin()"""


@contextlib.contextmanager
def node():
    """This process as a node; yields what starts another one that hears `words`, and the file of them."""
    with Master() as master:
        init_tool("test")
        log = master.folder / "heard"
        log.touch()
        yield lambda: master.start(sys.executable, "-c", SUBSCRIBER, log=log), log


def is_heard(publisher, log):
    wait_for(lambda: publisher.publish(String("here")) or "here" in log.read_text(), "the message", period=0.05)


@in_own_process
def test_a_subscriber_that_connects_before_the_publisher_is_ready():
    add = _PublisherImpl.add_subscriber_listener

    def add_slowly(topic, listener):
        add(topic, listener)
        start_subscriber()
        wait_for(lambda: topic.connections, "the connection")
        time.sleep(0.2)  # in which rospy goes on with it

    with node() as (start_subscriber, log):
        with mock.patch.object(_PublisherImpl, "add_subscriber_listener", add_slowly):
            publisher = DroppingPublisher("words", String)
        is_heard(publisher, log)


@in_own_process
def test_a_subscriber_behind_somebody_who_asks_another_node_that_had_this_port():
    with node() as (start_subscriber, log), socket.socket() as stranger:
        stranger.connect(("127.0.0.1", get_tcpros_server_address()[1]))
        stranger.sendall(b"POST /RPC2 HTTP/1.1\r\n\r\n")
        start_subscriber()
        is_heard(DroppingPublisher("words", String), log)


@in_own_process
def test_a_subscriber_that_stops_reading_loses_messages_and_holds_up_nobody():
    with node() as (start_subscriber, log), socket.socket() as hung:
        publisher = DroppingPublisher("words", String)
        hung.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        hung.connect(("127.0.0.1", get_tcpros_server_address()[1]))
        fields = ["callerid=/hung", "topic=/words", f"md5sum={String._md5sum}", f"type={String._type}"]
        header = b"".join(struct.pack("<I", len(field)) + field.encode() for field in fields)
        hung.sendall(struct.pack("<I", len(header)) + header)
        start_subscriber()
        wait_for(lambda: publisher.get_num_connections() == 2, "both")
        for _ in range(8000):  # 8 MB; Linux holds 4 MB at most
            publisher.publish(String("x" * 1000))
        is_heard(publisher, log)
        assert publisher.get_num_connections() == 2  # it costs itself messages, not its connection

"""Who connects to a node is heard, beside strangers."""

import contextlib
import socket
import sys

from rospy.impl.tcpros_base import get_tcpros_server_address
from std_msgs.msg import String

from robotont_driver.rospy_repairs.dropping_publisher import DroppingPublisher
from robotont_driver.rospy_repairs.rospy_process import init_tool
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
def test_a_subscriber_behind_somebody_who_asks_another_node_that_had_this_port():
    with node() as (start_subscriber, log), socket.socket() as stranger:
        stranger.connect(("127.0.0.1", get_tcpros_server_address()[1]))
        stranger.sendall(b"POST /RPC2 HTTP/1.1\r\n\r\n")
        start_subscriber()
        is_heard(DroppingPublisher("words", String), log)

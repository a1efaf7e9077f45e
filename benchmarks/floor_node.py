#!/usr/bin/env python3
"""A rospy node that does nothing but relay, beside which the driver's nodes are measured.

floor_node.py KIND, with KIND: twist_to_string, string_to_string, string_to_port PATH, port_to_string PATH.
Topics: ~in and ~out.
"""

import os
import sys
import threading
import tty

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String


def relay(kind, port=None):
    """Start relaying."""
    if kind == "string_to_port":
        line = open_port(port)
        rospy.Subscriber("~in", String, lambda message: os.write(line, message.data.encode()),
                         queue_size=1, tcp_nodelay=True)
        return
    publisher = rospy.Publisher("~out", String, queue_size=1)
    if kind == "port_to_string":
        threading.Thread(target=publish_port, args=(open_port(port), publisher), daemon=True).start()
    elif kind == "twist_to_string":
        rospy.Subscriber("~in", Twist, lambda _: publisher.publish("1:2:3;\n"), queue_size=1, tcp_nodelay=True)
    else:
        rospy.Subscriber("~in", String, publisher.publish, queue_size=1, tcp_nodelay=True)


def open_port(port):
    """File descriptor of a raw terminal."""
    line = os.open(port, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(line)
    return line


def publish_port(line, publisher):
    """Publish what comes, as it comes."""
    while True:
        publisher.publish(os.read(line, 4096).decode())


if __name__ == "__main__":
    rospy.init_node("floor")
    relay(*rospy.myargv(sys.argv)[1:])
    rospy.spin()

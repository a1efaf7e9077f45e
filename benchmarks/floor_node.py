#!/usr/bin/env python3
"""The least that a rospy node can do between cmd_vel and a port, and the port and odom: the floor of the driver.

One process without limits, time-outs, checks, odometry, TF or diagnostics. It writes a command's speed to ~port at
once, and publishes the first number of each line that it reads there as an Odometry, made before.
"""

import gc
import os
import threading
import tty

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry


def open_port(port):
    """File descriptor of a raw terminal."""
    line = os.open(port, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(line)
    return line


def publish_port(line, publisher):
    """Publish each line as it comes."""
    odom = Odometry()
    rest = b""
    while True:
        *lines, rest = (rest + os.read(line, 4096)).split(b"\n")
        for text in lines:
            try:
                odom.twist.twist.linear.x = -float(text.partition(b":")[0])
            except ValueError:
                continue  # part of a line, from before the start
            odom.header.stamp = rospy.Time.now()
            publisher.publish(odom)


def main():
    """Relay."""
    rospy.init_node("floor")
    line = open_port(rospy.get_param("~port"))
    publisher = rospy.Publisher("odom", Odometry)  # without queue_size: from the calling thread, which is faster
    rospy.Subscriber("cmd_vel", Twist, lambda twist: os.write(line, b"%.2f;\n" % (100.0 * twist.linear.x)),
                     queue_size=1, tcp_nodelay=True)
    threading.Thread(target=publish_port, args=(line, publisher), daemon=True).start()
    gc.collect()
    gc.freeze()
    rospy.spin()


if __name__ == "__main__":
    main()

"""driver_node, serial_com_node and odom_node in one process: no packet between them is serialised or changes thread.

Each keeps its name for parameters, diagnostics, topics and services, as if it ran alone;
rosnode knows the process only, by its own name.
"""

import functools

import rospy

from robotont_driver.nodes import driver_node, odom_node, serial_com_node
from robotont_driver.ros.lifecycle import init_node, serve
from robotont_driver.ros.packet_topics import SharedPacketTopic

# In this order they stop: driver_node's last packet is the stop that serial_com_node sends before it closes the port.
PARTS = {"driver_node": driver_node.DriverNode, "serial_com_node": serial_com_node.SerialComNode,
         "odom_node": odom_node.OdomNode}


def main():
    """Run robotont_node."""
    init_node("robotont_node", __doc__)
    shared = functools.lru_cache(maxsize=None)(SharedPacketTopic)
    serve({rospy.resolve_name(name): node_class for name, node_class in PARTS.items()}, shared)

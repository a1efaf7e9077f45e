"""driver_node, serial_com_node and odom_node in one process: no packet between them is serialised or changes thread.

Each keeps its name for parameters, diagnostics, topics and services, as if it ran alone;
rosnode knows the process only, by its own name.
"""

import rospy

from robotont_driver.nodes import driver_node, odom_node, serial_com_node
from robotont_driver.ros.lifecycle import init_node, serve
from robotont_driver.ros.packet_topics import topics_within_process

# In this order they stop: driver_node's last packet is the stop that serial_com_node sends before it closes the port.
PARTS = {"driver_node": driver_node, "serial_com_node": serial_com_node, "odom_node": odom_node}


def main():
    """Run robotont_node."""
    init_node("robotont_node", __doc__)
    topics = topics_within_process()
    serve(*(module.part(rospy.resolve_name(name), topics) for name, module in PARTS.items()))

"""A node beside a robot: drives at 0.2 m/s, has a place on a map, and takes goals as move_base does.

stand_in_navigation.py LOG: writes a line for each goal and each cancel. SIGUSR1: a person beside the robot releases the
emergency stop.
"""

import signal
import sys

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped, TransformStamped, Twist
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

rospy.init_node("move_base")
LOG = open(sys.argv[1], "a", buffering=1)  # noqa: SIM115


rospy.Subscriber("move_base_simple/goal", PoseStamped, lambda message: LOG.write(
    f"goal {message.pose.position.x:g} {message.pose.position.y:g}\n"))
rospy.Subscriber("move_base/cancel", GoalID, lambda message: LOG.write(f"cancel {message.id}\n"))
transforms = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
commands = rospy.Publisher("cmd_vel", Twist, queue_size=1)


def on_pressed_by(message):
    pressed.append(message.data)
    commands.publish(Twist())  # who has not stopped once may not drive behind a stop, however short it was


pressed = [""]
rospy.Subscriber("emergency_stop/pressed_by", String, on_pressed_by)
at_map = TransformStamped(child_frame_id="odom")
at_map.header.frame_id = "map"
at_map.transform.translation.x, at_map.transform.rotation.w = 1.0, 1.0
transforms.publish([at_map])
released = []
signal.signal(signal.SIGUSR1, lambda *_: released.append(False))  # not from there: what it interrupts may hold a lock
release = rospy.ServiceProxy("emergency_stop/release", Trigger)
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    command = Twist()
    command.linear.x = 0.0 if pressed[-1] else 0.2
    commands.publish(command)
    while released:
        released.pop()
        release()
    rate.sleep()

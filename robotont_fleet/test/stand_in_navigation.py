"""A node beside a robot that drives at 0.2 m/s while nobody presses its emergency stop."""

import rospy
from geometry_msgs.msg import Twist, Vector3
from std_msgs.msg import String

rospy.init_node("move_base")
commands = rospy.Publisher("cmd_vel", Twist, queue_size=1)
pressed = [""]


def on_pressed_by(message):
    pressed.append(message.data)
    commands.publish(Twist())  # who has not stopped once may not drive behind a stop, however short it was


rospy.Subscriber("emergency_stop/pressed_by", String, on_pressed_by)
rospy.Timer(rospy.Duration(0.1), lambda _: commands.publish(Twist(linear=Vector3(x=0.0 if pressed[-1] else 0.2))))
rospy.spin()

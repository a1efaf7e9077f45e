"""A node beside a robot that drives at 0.2 m/s. SIGUSR1: a person beside the robot releases the emergency stop."""

import signal

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import String
from std_srvs.srv import Trigger

rospy.init_node("move_base")
commands = rospy.Publisher("cmd_vel", Twist, queue_size=1)


def on_pressed_by(message):
    pressed.append(message.data)
    commands.publish(Twist())  # who has not stopped once may not drive behind a stop, however short it was


pressed = [""]
rospy.Subscriber("emergency_stop/pressed_by", String, on_pressed_by)
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

"""cmd_vel_mux that ends between a release and the stop of who asked for motion, and goals that came meanwhile."""

import signal

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import Twist, Vector3
from std_msgs.msg import String

from robotont_testing import places
from robotont_testing.harness import Master, in_own_process, wait_for


@in_own_process
def test_who_has_to_stop_first_has_to_behind_a_restart_and_goals_of_the_stop_end_with_it():
    with Master() as master:
        rospy.init_node("program", disable_signals=True)
        sent, cancelled, drives = [], [], []
        rospy.Subscriber("cmd_vel", Twist, lambda twist: sent.append(twist.linear.x))
        rospy.Subscriber("cmd_vel/driven_by", String, lambda who: drives.append(who.data))
        rospy.Subscriber("move_base/cancel", GoalID, cancelled.append)
        pressed_by = rospy.Publisher("emergency_stop/pressed_by", String, queue_size=1, latch=True)
        program = rospy.Publisher("cmd_vel/default", Twist, queue_size=1)
        mux = master.start(places.program("robotont_teleop", "cmd_vel_mux"))
        rospy.Timer(rospy.Duration(0.05), lambda _: program.publish(Twist(linear=Vector3(x=0.2))))
        wait_for(lambda: sent and sent[-1], "motion")
        pressed_by.publish("/button")
        wait_for(lambda: cancelled and not sent[-1], "the stop")
        del cancelled[:]
        pressed_by.publish("")
        wait_for(lambda: rospy.get_param("cmd_vel_mux_held", []) == ["/program"], "the parameter")
        wait_for(lambda: cancelled, "the end of goals that came during the stop")
        master.stop(mux, signal.SIGKILL)
        del sent[:], drives[:]
        master.start(places.program("robotont_teleop", "cmd_vel_mux"))
        wait_for(lambda: drives and program.get_num_connections(), "the new mux")
        rospy.sleep(1.0)  # nothing happens
        assert not any(sent)

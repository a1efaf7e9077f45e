"""What rospy does not do, or does wrong: its private parts, its end, its log, its publishers, outages of the network.

In and out go rospy's own objects.
"""

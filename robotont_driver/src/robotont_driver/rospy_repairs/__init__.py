"""What rospy does not do, or does wrong: its end, its log, its publishers, its connections, outages."""

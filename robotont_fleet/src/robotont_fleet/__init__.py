"""Many robots on one page. In go ROS topics of each robot; out come JSON messages over zenoh."""

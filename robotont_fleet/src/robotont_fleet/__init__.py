"""Many robots on one page. In go ROS topics of each robot; out comes zenoh, with the keys of Open-RMF's free_fleet."""

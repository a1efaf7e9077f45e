"""Code shared by the tests of several packages, the demo and the benchmarks.

harness: processes and a ROS master that end with their test. node_test: a rostest's topics and diagnostics.
stand_in_board: a board behind a pseudo-terminal. simulated_wheels: synthetic drives. robots: wheel parameters.
spoilt: files with errors.
rviz_stage, rviz_sight: RViz on a virtual screen, and the content of its picture. places: files of other packages.

Nothing here imports the packages that it tests, so that a test never compares code with itself.
"""

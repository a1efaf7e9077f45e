"""The page in a browser, and its server.

In go messages of open pages and the robot's topics. Out come commands by hand, requests, and the robot's state for
pages and Prometheus.
"""

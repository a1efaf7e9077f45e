#!/usr/bin/env python3
"""The emergency stop of the page: over restarts, broken connections and stalls."""

import rospy
import rostest
from std_srvs.srv import Trigger
from web_pages import OPEN, PageServerTest

from robotont_testing.harness import wait_for
from robotont_testing.node_test import WARN
from robotont_testing.stalling_proxy import StallingProxy

DRIVER = "driver_node: command stream"


class WebTeleopStopTest(PageServerTest):
    def test_a_stop_outlives_the_pages_server_and_its_release_moves_nothing(self):
        self.start_driver_node()
        page = self.stop_over_a_restart("stopped")
        page.wait("!$('stopped').hidden", "the stop, over a restart of the page's server")
        page.push(1, "#move", 0.0, 0.9)
        wait_for(lambda: self.status[DRIVER].level == WARN, "the stop")
        rospy.ServiceProxy("emergency_stop/release", Trigger)()
        page.wait("$('can').textContent.includes('Let go of')", "the request to let go")
        self.assertFalse([command for command in self.hand if any(command)])

    def test_a_stop_that_no_driver_has_heard_yet_outlives_the_pages_server(self):
        page = self.stop_over_a_restart("stop_waits")
        self.start_driver_node()
        wait_for(self.pressed, "the stop")
        page.wait("$('stop_waits').hidden && !$('stopped').hidden", "words about the stop")
        rospy.ServiceProxy("emergency_stop/release", Trigger)()

    def stop_over_a_restart(self, shown):
        """A page on which STOP was tapped, and shown by this id, before its server ended and started again."""
        server, page = self.start(), self.open()
        page.finger(1, "#stop")
        page.lift()
        page.wait(f"!$('{shown}').hidden", "the stop")
        self.processes.stop(server)
        page.wait(f"!({OPEN})", "the end of the connection")
        self.start()
        page.wait(OPEN, "the new connection")
        return page

    def start_driver_node(self):
        self.addCleanup(rospy.set_param, "/emergency_stop_pressed", [])
        self.processes.node("driver_node")
        wait_for(lambda: DRIVER in self.status, "driver_node")

    def pressed(self):
        return self.values(DRIVER)["emergency stop"] != "not pressed"

    def open_through_proxy(self):
        """(page, proxy); through which it stalls."""
        self.start_driver_node()
        self.start()
        proxy = StallingProxy(self.port)
        self.addCleanup(proxy.close)
        return self.open(f"http://127.0.0.1:{proxy.port}/"), proxy

    def test_a_stop_that_a_broken_connection_swallows_goes_out_on_the_next(self):
        page, proxy = self.open_through_proxy()
        proxy.stall()
        page.finger(1, "#stop")
        page.lift()
        page.wait("$('stop_waits').offsetWidth === innerWidth", "a bar over the whole width")
        self.assertFalse(self.pressed())
        page.wait("window.sockets > 1", "a new connection instead of the dead one")
        proxy.cut()
        proxy.flow()
        wait_for(self.pressed, "the stop")
        page.wait("$('stop_waits').hidden", "the end of the bar")
        page.wait("!$('stopped').hidden", "words about the stop")


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_stop_test", WebTeleopStopTest)

#!/usr/bin/env python3
"""The emergency stop of the page: over restarts, broken connections and stalls."""

import rospy
import rostest
from page_server_test import PageServerTest
from std_msgs.msg import Bool

from robotont_testing.harness import wait_for
from robotont_testing.node_test import WARN
from robotont_testing.stalling_proxy import StallingProxy

LOG_SOCKETS = """window.sockets = 0;
window.sent = [];
const Real = WebSocket;
window.WebSocket = class extends Real {
  constructor(address) {
    super(address);
    window.sockets++;
  }

  send(text) {
    window.sent.push(text);
    super.send(text);
  }
};"""


class WebTeleopStopTest(PageServerTest):
    def test_an_emergency_stop_reaches_whoever_starts_later_and_only_a_person_releases_it(self):
        stops = self.listen("emergency_stop", Bool)
        rospy.set_param("/emergency_stop_pressed", False)
        server = self.start()
        page = self.page()
        page.send({"kind": "stop"})
        wait_for(lambda: page.messages["state"]["stopped"], "the stop")
        driver = self.processes.node("driver_node")
        self.wait_for_status("driver_node: command stream", WARN, "emergency stop")
        self.processes.stop(server)
        self.log.write_text("")
        self.start()
        page = self.page()
        self.assertTrue(page.messages["state"]["stopped"], "forgotten over a restart of the page's server")
        self.assertTrue(all(stop.data for stop in stops), "released by a start or an end")

        page.send({"kind": "stop"})  # which this server latches
        wait_for(lambda: len(stops) > 1, "the stop")
        self.publisher("emergency_stop", Bool, subscribers=3).publish(False)
        wait_for(lambda: not page.messages["state"]["stopped"], "the release by somebody else")
        self.processes.stop(driver)
        self.status.clear()
        self.processes.node("driver_node")
        wait_for(lambda: "driver_node: command stream" in self.status, "driver_node")
        self.publisher("emergency_stop", Bool, subscribers=3)
        seen = self.status["driver_node: command stream"]
        wait_for(lambda: self.status["driver_node: command stream"] is not seen, "newer diagnostics")
        self.assertEqual(self.values("driver_node: command stream")["emergency stop"], "not pressed",
                         "a press that was released lives on")

    def open_through_proxy(self):
        """(page, proxy); the page counts its sockets and keeps what it sends."""
        self.addCleanup(rospy.set_param, "/emergency_stop_pressed", False)
        rospy.set_param("/emergency_stop_pressed", False)
        self.start()
        proxy = StallingProxy(self.port)
        self.addCleanup(proxy.close)
        return self.open(f"http://127.0.0.1:{proxy.port}/", script=LOG_SOCKETS), proxy

    def test_a_stop_that_a_broken_connection_swallows_goes_out_on_the_next(self):
        stops = self.listen("emergency_stop", Bool)
        page, proxy = self.open_through_proxy()
        proxy.stall()
        page.finger(1, "#stop")
        page.lift()
        page.wait("document.getElementById('message').textContent.includes('has not reached')", "words for the driver")
        self.assertFalse(stops)
        page.wait("window.sockets > 1", "a new connection instead of the dead one")
        proxy.cut()
        proxy.flow()
        wait_for(lambda: stops, "the stop")
        page.wait("document.getElementById('message').hidden", "the end of these words")
        page.wait("!document.getElementById('stopped').hidden", "words about the stop")

    def test_a_release_that_a_stall_holds_up_releases_nothing(self):
        stops = self.listen("emergency_stop", Bool)
        page, proxy = self.open_through_proxy()
        page.finger(1, "#stop")
        page.lift()
        page.wait("!document.getElementById('stopped').hidden", "words about the stop")
        page.finger(2, "#release")
        page.wait("document.getElementById('release').classList.contains('filling')", "the hold")
        proxy.stall("up")
        page.wait("window.sent.some((text) => text.includes('release'))", "the release, which waits on its way")
        page.lift()
        then = page.run("performance.now()")
        wait_for(lambda: page.run("performance.now()") > then + 250, "a release that is too old")
        proxy.flow()
        page.wait("document.getElementById('message').textContent.includes('too late')", "words for the driver")
        self.assertTrue(all(stop.data for stop in stops))
        page.finger(2, "#release")
        wait_for(lambda: not stops[-1].data, "the release that is held anew")
        page.lift()


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_stop_test", WebTeleopStopTest)

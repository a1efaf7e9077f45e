"""Presses reach a driver_node that starts later; what a person asks for ends by itself and in time."""

import io
import socket
import threading
import time
from unittest.mock import Mock

import rosgraph
import rospy
from rosgraph.network import read_ros_handshake_header, write_ros_handshake_header
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger, TriggerResponse

from robotont_teleop.hand import emergency_stop_publisher, service_request
from robotont_teleop.hand.emergency_stop_publisher import HELD, EmergencyStopPublisher
from robotont_teleop.hand.service_request import OLDEST, ServiceRequest
from robotont_testing.bus import Bus
from robotont_testing.harness import Master, in_own_process, suspended, wait_for
from robotont_testing.robots import WHEEL_PARAMS


@in_own_process
def test_what_a_person_asks_for_is_never_carried_out_late():
    with Master() as master:
        rospy.init_node("hand", disable_signals=True)
        master.load(WHEEL_PARAMS)
        said, failures, asked, answers = [], [], [], []
        rospy.Subscriber("emergency_stop/pressed_by", String, lambda message: said.append(message.data))
        rospy.Service("reset_odometry", Trigger, lambda request: asked.append(request) or (True, ""))
        button = EmergencyStopPublisher(failures.append)
        reset = ServiceRequest("reset_odometry", "reset odometry", answers.append)
        button.press()
        assert (button.pressed, button.waits, button.has_driver) == (True, True, False)
        driver = master.node("driver_node")
        wait_for(lambda: said and said[-1] == "/hand", "the press, by who starts later")
        wait_for(lambda: not button.waits, "driver_node's word that the robot stands by it")
        assert button.has_driver
        with suspended(master._master.pid):
            button.release()
            reset.call()
            time.sleep(0.1)  # the first is on its way to the master
            button.press()  # newer than both
            time.sleep(OLDEST)  # so long they take
        wait_for(lambda: failures and answers, "words about both")
        assert failures[0].startswith("release of the emergency stop: "), "without an answer nobody knows whether it is"
        assert said[-1] == "/hand"
        assert button.pressed
        assert not asked
        wait_for(lambda: button.release() or (said[-1] == "" and not button.pressed), "a release that is asked for now",
                 period=0.5)  # again: a driver_node that was starved of processor time refuses one
        reset.call()
        wait_for(lambda: answers[1:] == ["reset odometry: done"], "an answer now")
        master.stop(driver)
        said.clear()
        master.node("driver_node")
        wait_for(lambda: said, "driver_node again")
        time.sleep(0.2)  # in which a press would reach it
        assert set(said) == {""}, "a press that was released lives on"


class Button(Bus):
    """An EmergencyStopPublisher, and a driver_node that only says who presses."""

    def __init__(self, monkeypatch):
        super().__init__(monkeypatch, emergency_stop_publisher)
        monkeypatch.setattr(emergency_stop_publisher, "ServiceRequest", self._request)
        self.button, self.pressed = EmergencyStopPublisher(), self.sent["emergency_stop"]

    def _request(self, _service, _what, _report, unwanted, done, seen):
        self.unwanted, self.done, self.seen = unwanted, done, seen
        return Mock()

    def say(self, *names):
        self.hear("emergency_stop/pressed_by", String(", ".join(names)))


def test_a_release_that_was_begun_before_a_press_does_not_end_it(monkeypatch):
    bus = Button(monkeypatch)
    bus.button.press()
    bus.say("/node")
    bus.say()  # another's, at once: whoever has asked for it has not seen this press
    assert bus.pressed == [Bool(True)] * 2
    bus.say("/node")
    bus.now += HELD
    bus.say()  # asked for anew: that the press was given again makes it no younger
    assert bus.pressed == [Bool(True), Bool(True), Bool(False)]
    bus.button.press()
    bus.say("/node")
    bus.button.release()
    bus.say()  # the own release counts at once
    assert bus.pressed[3:] == [Bool(True), Bool(False)]
    assert not bus.button.pressed


def test_a_release_tells_which_presses_its_person_has_seen_and_ends_no_newer_one(monkeypatch):
    bus = Button(monkeypatch)
    bus.say("/other")
    assert (bus.button.pressed, bus.button.waits) == (True, False)
    bus.button.press()
    assert bus.button.waits, "the robot stands by another press, which may have ended"
    assert bus.seen() == "/node, /other"
    asked = bus.now
    bus.now += 0.1
    assert not bus.unwanted(asked)
    bus.button.press()
    assert bus.unwanted(asked) == "it was pressed again meanwhile"
    bus.done(asked)
    assert bus.pressed == [Bool(True)] * 3, "what was carried out all the same is pressed again"


def test_a_call_without_an_answer_ends_and_holds_up_none_behind_it(monkeypatch):
    closed, answer = threading.Event(), TriggerResponse(True, "now")
    hung = Mock(side_effect=lambda _request: closed.wait() and answer, close=closed.set)  # answers late
    monkeypatch.setattr(service_request, "LONGEST", 0.5)
    monkeypatch.setattr(rospy, "ServiceProxy", Mock(side_effect=[hung, Mock(return_value=answer)]))
    answers, before = [], threading.active_count()
    request = ServiceRequest("give_back", "give back", answers.append)
    request.call()
    wait_for(lambda: hung.called, "the first call")
    request.call()
    wait_for(lambda: answers == ["give back: now"], "the answer to the second", timeout=0.4)
    wait_for(lambda: answers[1:] == ["give back: no answer within 0.5 s: ask again"], "the end of the first")
    wait_for(lambda: threading.active_count() <= before, "the end of its threads")
    assert len(answers) == 2, "the late answer"


@in_own_process
def test_what_the_network_holds_up_does_not_go_out_once_there_was_no_answer():
    """Behind an outage a release would come that is older than a press."""
    service_request.LONGEST = 1.0
    with Master(), socket.create_server(("127.0.0.1", 0)) as server:
        rospy.init_node("hand", disable_signals=True)
        answers, heard, ended, back = [], [], threading.Event(), threading.Event()
        request = ServiceRequest("give_back", "give back", answers.append, seen=lambda: "/other")

        def hold_up():
            for waits in (False, True):  # a question whether it is there, and the call
                connection, _ = server.accept()
                header = read_ros_handshake_header(connection, io.BytesIO(), 65536)
                assert not waits or header["seen"] == "/other"  # of what the person has seen
                if waits:
                    back.wait()
                write_ros_handshake_header(connection, {"md5sum": Trigger._md5sum, "type": Trigger._type})
            heard.append(connection.recv(9))
            ended.set()
        threading.Thread(target=hold_up, daemon=True).start()
        rosgraph.Master("hand").registerService("/give_back", f"rosrpc://127.0.0.1:{server.getsockname()[1]}",
                                                rospy.get_node_uri())
        request.call()
        wait_for(lambda: answers, "words that there was no answer")
        back.set()
        wait_for(ended.is_set, "the end of the connection")
        assert heard == [b""]

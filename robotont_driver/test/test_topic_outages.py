import errno
import threading
from unittest.mock import Mock

import pytest

from robotont_driver.ros import topic_outages
from robotont_driver.rospy_repairs import rospy_internals
from robotont_testing.harness import wait_for


@pytest.fixture
def connect_anew(monkeypatch):
    monkeypatch.setattr(topic_outages, "Worker", Mock())
    monkeypatch.setattr(topic_outages, "connect_anew", Mock())
    return topic_outages.connect_anew


def test_who_was_dropped_is_connected_again_once(connect_anew):
    here = Mock(**{"getsockname.return_value": ("127.0.0.1", 1), "getpeername.return_value": ("127.0.0.1", 2)})
    subscriber = Mock(impl=Mock(connections=[Mock(endpoint_id=uri, socket=here) for uri in ("http://a", "http://b")]))
    watch = topic_outages.OutageWatch(newest=[subscriber])
    watch._look()
    connect_anew.assert_not_called()
    subscriber.impl.connections.pop(0)
    for _ in range(3):
        watch._look()
    connect_anew.assert_called_once_with(subscriber, "http://a")


@pytest.fixture
def manager(monkeypatch):
    """rospy's RegManager as this stack mends it, whose node notes whom it asks for a connection."""
    manager = rospy_internals.RegManager
    monkeypatch.setattr(manager, "_connect_topic_thread", manager._connect_topic_thread)  # to be put back
    rospy_internals._connect_when_within_reach.__wrapped__()
    manager = manager(Mock(done=False, asked=[]))
    manager.handler._connect_topic = lambda topic, uri: manager.handler.asked.append((topic, uri)) or (1, "", 0)
    monkeypatch.setattr(rospy_internals, "get_registration_listeners", lambda: Mock(listeners=[manager]))
    threading.Thread(target=manager.run, daemon=True).start()
    yield manager
    manager.handler.done = True


def test_who_is_connected_again_while_the_master_names_another_takes_nothing_from_it(manager, monkeypatch):
    monkeypatch.setattr(rospy_internals, "within_reach", lambda place: True)
    with manager.cond:  # it sleeps: both come before it looks
        manager.publisher_update("/cmd_vel", ["http://old:1", "http://new:2"])
        rospy_internals.connect_anew(Mock(resolved_name="/cmd_vel"), "http://old:1")
    wait_for(lambda: ("/cmd_vel", "http://new:2") in manager.handler.asked, "the new one")


def test_a_publisher_out_of_reach_is_asked_as_soon_as_it_is_back_and_not_before(manager, monkeypatch):
    looks, back = [], threading.Event()
    monkeypatch.setattr(rospy_internals, "within_reach", lambda place: looks.append(place) or back.is_set())
    manager.publisher_update("/cmd_vel", ["http://one:1"])
    wait_for(lambda: len(looks) > 2, "looks")
    assert manager.handler.asked == []
    back.set()
    wait_for(lambda: manager.handler.asked == [("/cmd_vel", "http://one:1")], "the question")


@pytest.mark.parametrize("error, answers", [(ConnectionRefusedError(), True), (OSError(errno.EHOSTUNREACH, ""), False),
                                            (TimeoutError(), False), (None, True)])
def test_a_machine_that_answers_is_within_reach_though_nobody_listens_there(monkeypatch, error, answers):
    monkeypatch.setattr(rospy_internals.socket, "create_connection", Mock(side_effect=error and [error]))
    assert rospy_internals.within_reach(Mock()) is answers

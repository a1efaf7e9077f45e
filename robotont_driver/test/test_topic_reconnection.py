import socket
import threading
from types import SimpleNamespace
from unittest.mock import Mock

import pytest

from robotont_driver.rospy_repairs import rospy_internals, topic_reconnection
from robotont_testing.harness import wait_for

HERE, THERE = "10.0.0.1", "10.0.0.2"


class Connection:
    """One to a publisher at `uri` on another machine."""

    def __init__(self, uri="http://10.0.0.2:1"):
        self.endpoint_id = uri
        self.header = {}
        self.socket = SimpleNamespace(getsockname=lambda: (HERE, 1), getpeername=lambda: (THERE, 2))


class Network:
    """A Reconnector with a clock of its own; machines answer while `up`."""

    def __init__(self, monkeypatch):
        self.now, self.up, self.calls = 0.0, True, []
        self.commands, self.buttons = (Mock(impl=Mock(connections=[])) for _ in range(2))
        monkeypatch.setattr(topic_reconnection, "connect_anew", lambda topic, uri: self.calls.append((topic, uri)))
        monkeypatch.setattr(topic_reconnection, "disconnect",
                            lambda topic, connection: topic.impl.connections.remove(connection))
        monkeypatch.setattr(topic_reconnection.socket, "create_connection", self._answer)
        monkeypatch.setattr(topic_reconnection.threading, "Thread", self._thread)
        self.watch = topic_reconnection.Reconnector(lambda: self.now, [self.commands, self.buttons])

    def _answer(self, *_):
        if not self.up:
            raise socket.timeout()
        return SimpleNamespace(close=lambda: None)

    @staticmethod
    def _thread(target, args, daemon):
        return SimpleNamespace(start=lambda: target(*args), is_alive=lambda: False)

    def look(self, seconds):
        for _ in range(round(seconds / topic_reconnection.PERIOD)):
            self.now += topic_reconnection.PERIOD
            self.watch.look()


@pytest.fixture
def network(monkeypatch):
    return Network(monkeypatch)


def test_who_was_dropped_is_connected_again_once(network):
    network.commands.impl.connections += [Connection("http://a:1"), Connection("http://b:1")]
    network.look(1.0)
    assert network.calls == []
    network.commands.impl.connections.pop(0)
    network.look(5.0)
    assert network.calls == [(network.commands, "http://a:1")]


def test_behind_an_outage_all_are_connected_anew_and_the_old_ones_still_deliver(network):
    command, button = Connection(), Connection()
    network.commands.impl.connections.append(command)
    network.buttons.impl.connections.append(button)
    network.look(10.0)
    network.up = False
    network.look(12.0)
    assert network.calls == []
    network.up = True
    network.look(1.0)
    assert sorted(map(str, network.calls)) == sorted(map(str, [
        (network.commands, "http://10.0.0.2:1"), (network.buttons, "http://10.0.0.2:1")]))
    assert (network.commands.impl.connections, network.buttons.impl.connections) == ([command], [button])
    assert button.endpoint_id != "http://10.0.0.2:1", "rospy would end it for the new one"
    network.look(10.0)
    assert len(network.calls) == 2


def test_old_connections_that_their_publisher_keeps_do_not_pile_up(network):
    for _ in range(2 * topic_reconnection.MOST_OLD):
        network.buttons.impl.connections.append(Connection())
        network.look(3.0)
        network.up = False
        network.look(3.0)
        network.up = True
        network.look(1.0)
    assert len(network.buttons.impl.connections) == topic_reconnection.MOST_OLD


@pytest.mark.parametrize("machine", [HERE, THERE])
def test_a_publisher_that_is_about_to_be_connected_is_asked_by_nobody_else(network, machine):
    connection = Connection()
    connection.socket = None
    network.buttons.impl.connections.append(connection)
    network.up = False
    network.look(20.0)  # the handshake takes two round trips
    connection.socket = SimpleNamespace(getsockname=lambda: (HERE, 1), getpeername=lambda: (machine, 2))
    network.up = True
    network.look(20.0)
    assert network.calls == []
    assert network.buttons.impl.connections == [connection]


def test_who_is_connected_again_while_the_master_names_another_takes_nothing_from_it(monkeypatch):
    manager = rospy_internals.RegManager
    monkeypatch.setattr(manager, "_connect_topic_thread", manager._connect_topic_thread)  # to be put back
    rospy_internals._connect_once_at_a_time.__wrapped__()
    manager = manager(Mock(done=False, asked=[]))
    manager.handler._connect_topic = lambda topic, uri: manager.handler.asked.append((topic, uri)) or (1, "", 0)
    monkeypatch.setattr(rospy_internals, "get_registration_listeners", lambda: Mock(listeners=[manager]))
    threading.Thread(target=manager.run, daemon=True).start()
    with manager.cond:  # it sleeps: both come before it looks
        manager.publisher_update("/cmd_vel", ["http://old:1", "http://new:2"])
        rospy_internals.connect_anew(Mock(resolved_name="/cmd_vel"), "http://old:1")
    wait_for(lambda: ("/cmd_vel", "http://new:2") in manager.handler.asked, "the new one")
    manager.handler.done = True


@pytest.mark.parametrize("machine, local", [(HERE, True), ("127.0.0.1", True), (THERE, False)])
def test_whether_a_connection_comes_from_this_machine(machine, local):
    connection = Connection()
    connection.socket.getpeername = lambda: (machine, 2)
    subscriber = Mock(impl=Mock(connections=[Connection(), connection]))
    assert topic_reconnection.is_local([subscriber], connection.header) == local
    assert not topic_reconnection.is_local([subscriber], {}), "it has ended: nobody knows"

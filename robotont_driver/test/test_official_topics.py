"""What a board's readings do while the master hangs; that they are published, the rostests show."""

import threading
import time
from unittest.mock import Mock

from robotont_driver.protocol.protocol import Power
from robotont_driver.robots.battery import Battery
from robotont_driver.ros import official_topics, worker
from robotont_testing.harness import wait_for


def test_a_master_that_hangs_holds_up_no_caller_and_what_found_no_room_is_dropped(monkeypatch):
    answered, published = threading.Event(), []

    def publisher(*_, **__):
        answered.wait(20)
        return Mock(publish=published.append)
    for module in (official_topics, worker):
        monkeypatch.setattr(module, "rospy", Mock(Publisher=publisher, is_shutdown=lambda: answered.ended))
    answered.ended = False
    topics = official_topics.OfficialTopics("range_sensor_", "base_link", Battery(None))
    begun = time.monotonic()
    for _ in range(1000):
        topics.publish([Power(12.0, 1.0)])
    assert time.monotonic() - begun < 5
    assert published == []
    answered.set()
    wait_for(lambda: len(published) >= official_topics.MOST_WAITING, "the readings")
    answered.ended = True

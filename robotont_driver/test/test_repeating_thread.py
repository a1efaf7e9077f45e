"""Work at intervals."""

import pytest
import rospy

from robotont_driver.ros import repeating_thread
from robotont_testing.harness import wait_for


@pytest.mark.parametrize("ends", [False, True])  # rospy closes the topics before is_shutdown() says so
def test_a_fault_is_reported_and_is_not_the_end(monkeypatch, ends):
    said, looks = [], []
    monkeypatch.setattr(rospy, "logerr_throttle", lambda _, form, *words: said.append(form % words))
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: ends)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: len(looks) > 2)
    monkeypatch.setattr(repeating_thread, "AFTER_FAULT", 0.0)

    def look():
        looks.append(1)
        if len(looks) == 1:
            raise KeyError("seam")
        return 0.0

    thread = repeating_thread.RepeatingThread(look)
    wait_for(lambda: not thread.is_alive(), "the thread")
    assert len(looks) == 3
    assert ["KeyError: 'seam'" in words for words in said] == ([] if ends else [True])

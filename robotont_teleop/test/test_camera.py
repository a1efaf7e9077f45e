"""Pictures of a camera: the newest, while somebody wants to see them."""

from sensor_msgs.msg import CompressedImage

from robotont_teleop.web import camera
from robotont_testing.bus import Bus

JPEG = b"\xff\xd8 a picture "


def test_a_camera_that_nobody_watches_is_left_and_an_old_picture_is_none(monkeypatch):
    bus = Bus(monkeypatch, camera)
    watched = camera.Camera("camera")
    look, = bus.work
    look()
    assert (watched.present, watched.picture()) == (False, None)
    bus.publishers["/camera"] = ["/driver"]
    look()
    assert watched.present
    for number in (1, 2):
        bus.hear("camera", CompressedImage(data=JPEG + b"%d" % number))
        assert watched.picture() == (number, JPEG + b"%d" % number)
    bus.now += 1.0
    assert watched.picture() is None, "the newest is old"
    bus.now += 9.9
    look()
    assert bus.heard_by["camera"]
    bus.now += 0.1
    look()
    assert not bus.heard_by["camera"]

"""Pictures of a camera: the newest, while somebody wants to see them."""

from unittest import mock

import rospy
from sensor_msgs.msg import CompressedImage

from robotont_teleop.web import camera
from robotont_testing.harness import Master, in_own_process, wait_for

JPEG = b"\xff\xd8 a picture "


@in_own_process
def test_a_camera_that_nobody_watches_is_left_and_an_old_picture_is_none():
    with Master(), mock.patch.object(camera, "REST", 1.5):
        rospy.init_node("camera_test", disable_signals=True)
        publisher = rospy.Publisher("camera", CompressedImage, queue_size=50)
        watched = camera.Camera("camera")
        wait_for(lambda: watched.picture() or publisher.get_num_connections(), "the subscription")

        def shown_while(picture):
            publisher.publish(picture)
            return watched.picture()
        for data in (JPEG + b"1", JPEG + b"2"):
            wait_for(lambda data=data: (shown_while(CompressedImage(data=data)) or (0, b""))[1] == data, "the newest")
        png = CompressedImage(format="png", data=b"\x89PNG")  # no picture that is shown
        wait_for(lambda: shown_while(png) is None, "the end of the old picture", timeout=3)
        assert publisher.get_num_connections()
        wait_for(lambda: not publisher.get_num_connections(), "the end of the subscription")

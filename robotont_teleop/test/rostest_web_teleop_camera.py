#!/usr/bin/env python3
"""The camera's pictures on the page."""

import io
import socket
import unittest.mock

import rospy
import rostest
from page_server_test import PageServerTest
from PIL import Image
from sensor_msgs.msg import CompressedImage

from robotont_teleop.web import camera
from robotont_testing.harness import wait_for

CAMERA = "camera/color/image_raw/compressed"
NEWEST = 29  # number of the last of many pictures


def jpeg(number, size=(64, 48)):
    """A picture in whose end, behind what decoders read, stands a number."""
    output = io.BytesIO()
    Image.new("RGB", size, (40 * number % 256, 120, 200)).save(output, "JPEG")
    return output.getvalue() + f"{number:08d}".encode()


class WebTeleopCameraTest(PageServerTest):
    def start_camera(self):
        publisher = self.publisher(CAMERA, CompressedImage, subscribers=0)
        self.start()
        client = self.client()
        page = client.page()
        wait_for(lambda: page.messages.get("status", {}).get("camera"), "the camera")
        return publisher, client, page

    def test_the_camera_is_shown_its_newest_picture_only(self):
        publisher, client, _ = self.start_camera()
        page = self.open()
        page.wait("!document.getElementById('film').hidden", "the camera's button")
        page.finger(1, "#film")
        page.lift()
        wait_for(lambda: publisher.get_num_connections(), "the node")
        width = "document.getElementById('camera').naturalWidth"
        wait_for(lambda: publisher.publish(CompressedImage(format="jpeg", data=jpeg(1))) or page.run(width) == 64,
                 "the picture", period=0.05)
        wait_for(lambda: publisher.publish(CompressedImage(format="jpeg", data=jpeg(2, (96, 48)))) or
                 page.run(width) == 96, "the next one", period=0.05)
        status, headers, _ = client.request("GET", "/camera.jpg?after=0")
        shown = headers["X-Picture"] if status == 200 else 0
        for number in range(10, NEWEST + 1):
            publisher.publish(CompressedImage(format="jpeg", data=jpeg(number)))

        def picture(after):
            """Number of a picture that is newer than another; a picture that is too old by now comes once more."""
            status, headers, body = client.request("GET", f"/camera.jpg?after={after}")
            if status != 200:
                return publisher.publish(CompressedImage(format="jpeg", data=jpeg(NEWEST)))
            self.assertEqual(headers["Content-Type"], "image/jpeg")
            return int(body[-8:])
        wait_for(lambda: picture(0) == NEWEST, "the newest picture")
        self.assertEqual(wait_for(lambda: picture(shown), "a picture"), NEWEST, "a picture of the past")
        page.wait("!document.getElementById('camera').hasAttribute('src')", "the end of a picture that is old")
        self.assertEqual([words for words in page.complaints() if "404" not in str(words)], [])

    def test_no_command_waits_behind_a_picture(self):
        publisher, _, page = self.start_camera()
        reader = socket.create_connection(("127.0.0.1", self.port))
        self.addCleanup(reader.close)
        reader.sendall(f"GET /camera.jpg HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n".encode())
        wait_for(lambda: publisher.get_num_connections(), "the node")
        size = 20_000_000
        publisher.publish(CompressedImage(format="jpeg", data=jpeg(1) + bytes(size)))
        start = reader.recv(100)  # the answer has begun; nobody reads its rest
        self.assertTrue(start.startswith(b"HTTP/1.1 200"))
        self.drive(page)
        page.send({"kind": "ping", "time": 7.0})
        wait_for(lambda: "pong" in page.messages, "the answer")

    def test_a_camera_that_nobody_watches_is_left_and_an_old_picture_is_none(self):
        publisher = self.publisher(CAMERA, CompressedImage, subscribers=0)
        watched = camera.Camera(CAMERA)
        with unittest.mock.patch.object(camera, "REST", 1.5):
            watched.picture()
            watched.look({rospy.resolve_name(CAMERA)})
            wait_for(publisher.get_num_connections, "the subscription")
            publisher.publish(CompressedImage(format="png", data=b"\x89PNG"))
            picture = wait_for(lambda: watched.picture() or publisher.publish(CompressedImage(data=jpeg(1))),
                               "the picture", period=0.05)
            self.assertEqual(picture[1], jpeg(1), "what is no JPEG must be left out")
            wait_for(lambda: watched.picture() is None, "the end of the old picture", timeout=3)
            self.assertTrue(publisher.get_num_connections())
            wait_for(lambda: watched.look({}) or not publisher.get_num_connections(), "the end of the subscription")


if __name__ == "__main__":
    rostest.rosrun("robotont_teleop", "web_teleop_camera_test", WebTeleopCameraTest)

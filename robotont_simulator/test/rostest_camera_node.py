#!/usr/bin/env python3
"""The simulated camera's topics and frames."""

import math

import numpy as np
import rostest
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from simulation_test import SimulationTest
from tf2_msgs.msg import TFMessage

from robotont_testing.harness import wait_for


class CameraNodeTest(SimulationTest):
    def test_pictures_lenses_and_frames_are_those_of_realsense(self):
        transforms = self.listen("tf_static", TFMessage)
        self.start("world:=bangbang", "depth_camera:=true")
        topics = {"color": "camera/color/image_raw", "depth": "camera/depth/image_rect_raw",
                  "aligned": "camera/aligned_depth_to_color/image_raw"}
        seen = {name: self.listen(topic, Image) for name, topic in topics.items()}
        jpegs = self.listen("camera/color/image_raw/compressed", CompressedImage)
        lenses = self.listen("camera/depth/camera_info", CameraInfo)
        wait_for(lambda: jpegs and lenses and all(seen.values()), "pictures", timeout=60)
        colour, depth, aligned = (seen[name][-1] for name in topics)
        self.assertEqual((colour.encoding, colour.width, colour.height), ("rgb8", 424, 240))
        self.assertEqual((depth.encoding, aligned.encoding), ("16UC1", "16UC1"))
        self.assertEqual(colour.header.frame_id, "camera_color_optical_frame")
        self.assertEqual(depth.header.frame_id, "camera_depth_optical_frame")
        self.assertEqual(aligned.header.frame_id, colour.header.frame_id)
        self.assertEqual(jpegs[-1].data[:2], b"\xff\xd8")
        self.assertAlmostEqual(lenses[-1].K[0], 212 / math.tan(math.pi / 4), delta=0.01)
        children = {one.child_frame_id: one.header.frame_id for message in transforms for one in message.transforms}
        self.assertEqual(children["camera_color_optical_frame"], "camera_link")
        wait_for(lambda: self.scan, "a scan")
        pixels = np.frombuffer(depth.data, np.uint16).reshape(240, 424)
        ahead = self.scan[-1].ranges[64] - 0.107  # [m] the lens stands before the robot's middle
        self.assertAlmostEqual(pixels[110:120, 200:220].mean() / 1000, ahead, delta=0.03)


if __name__ == "__main__":
    rostest.rosrun("robotont_simulator", "camera_node_test", CameraNodeTest)

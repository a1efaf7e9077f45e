"""The frames tag_N of the tags that the camera sees, as ar_track_alvar's ar_marker_N: z out of the tag, y up.

The tags are those of ar_track_alvar, which prints them: `rosrun ar_track_alvar createMarker 5`. Where that package's
messages are installed, `ar_pose_marker` tells of them, too, in camera_link.
"""

import cv2
import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import CameraInfo, Image

from robotont_driver.parameters.parameters import Parameter
from robotont_driver.ros.lifecycle import run_without_wheels
from robotont_simulator.world import tag

try:
    from ar_track_alvar_msgs.msg import AlvarMarker, AlvarMarkers
except ImportError:
    AlvarMarkers = None

PARAMETERS = (
    Parameter("size", 0.2, "edge of the tags' black part", "m", minimum=0.005, maximum=10.0),
    Parameter("numbers", 32, "tags 0 to this number are looked for", minimum=1, maximum=255),
    Parameter("frame_prefix", "", "before the names of frames"),
)
CORNERS = 0.5 * np.array([(-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)], float)
OPTICAL = np.array([(0, 0, 1), (-1, 0, 0), (0, -1, 0)], float)  # axes of the lens in camera_link
ENLARGED = 2  # times, before tags are looked for: small ones are read at half the size
CELL, SHEET = 8, 4  # [pixels] of a cell, and of white around, in the pictures of tags that are laid over what is seen
IN_PICTURE = (SHEET - 0.5 + 9 * CELL * np.array([(0, 0), (1, 0), (1, 1), (0, 1)])).astype(np.float32)  # its corners
BLUR = 3  # [pixels] so wide are both smoothed
UNTIL = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 20, 1e-4)  # iterations, change of the correlation


class Detector:
    """Finds tags in grey pictures, height x width of uint8; `numbers`: how many, from 0 on."""

    def __init__(self, numbers, size):
        codes = [np.array([[cell == "w" for cell in row[2:7]] for row in tag(number)[2:7]], np.uint8)
                 for number in range(numbers + 1)]
        self._pictures = [np.pad(np.kron([[255 * (cell == "w") for cell in row] for row in tag(number)],
                                         np.ones((CELL, CELL))), SHEET, constant_values=255).astype(np.uint8)
                          for number in range(numbers + 1)]
        self._corners = CORNERS * size
        aruco = cv2.aruco
        new = hasattr(aruco, "ArucoDetector")  # since OpenCV 4.7
        code_bytes = np.concatenate([aruco.Dictionary_getByteListFromBits(code) if not new else
                                     aruco.Dictionary.getByteListFromBits(code) for code in codes])
        options = aruco.DetectorParameters() if new else aruco.DetectorParameters_create()
        options.markerBorderBits = 2
        options.errorCorrectionRate = 0.0
        options.maxErroneousBitsInBorderRate = 0.1  # else the edge of the sheet is read as another tag's
        options.minMarkerPerimeterRate = 0.02
        options.minMarkerDistanceRate = 0.01  # the edge of the white sheet is near that of the tag, and no other tag
        if new:
            find = aruco.ArucoDetector(aruco.Dictionary(code_bytes, 5, 0), options)
            self._find = find.detectMarkers
        else:
            dictionary = aruco.custom_dictionary(1, 5)
            dictionary.bytesList, dictionary.maxCorrectionBits = code_bytes, 0
            self._find = lambda grey: aruco.detectMarkers(grey, dictionary, parameters=options)

    def find(self, grey, matrix):
        """{number: (rotation vector [rad], place [m])} of the tags, seen from the lens with a 3 x 3 camera `matrix`."""
        enlarged = cv2.resize(grey, None, fx=ENLARGED, fy=ENLARGED, interpolation=cv2.INTER_CUBIC)
        corners, numbers, _ = self._find(enlarged)
        found = {}
        seen = zip([] if numbers is None else numbers.ravel().tolist(), corners)
        for number, corner in sorted(seen, key=lambda one: np.ptp(one[1])):  # the outermost edge of several wins
            places = self._aligned(number, grey, (corner.reshape(4, 2) + 0.5) / ENLARGED - 0.5)
            good, rotation, place = cv2.solvePnP(self._corners, places, matrix, None)
            if good:
                found[number] = rotation.ravel(), place.ravel()
        return found

    def _aligned(self, number, grey, places):
        """The corners at `places`, 4 x 2 [pixels], to parts of a pixel: as all edges of the tag together fit best.

        Method: G. Evangelidis and E. Psarakis, Parametric image alignment using enhanced correlation coefficient
        maximization, IEEE PAMI 30 (2008).
        """
        start = np.maximum(places.min(axis=0) - 0.2 * np.ptp(places), 0).astype(int)
        (left, top), (right, bottom) = start, (places.max(axis=0) + 0.2 * np.ptp(places)).astype(int)
        warp = cv2.getPerspectiveTransform(IN_PICTURE, (places - start).astype(np.float32)).astype(np.float32)
        try:
            _, warp = cv2.findTransformECC(self._pictures[number], grey[top:bottom, left:right], warp,
                                           cv2.MOTION_HOMOGRAPHY, UNTIL, None, BLUR)
        except cv2.error:  # it finds no better ones
            return places
        return cv2.perspectiveTransform(IN_PICTURE[None], warp)[0] + start.astype(float)


class TagsNode:
    """Turns pictures into frames."""

    def __init__(self, parameters):
        self._prefix = parameters["frame_prefix"]
        self._detector = Detector(parameters["numbers"], parameters["size"])
        self._matrix = None
        self._broadcaster = tf2_ros.TransformBroadcaster()
        if AlvarMarkers:
            self._markers = rospy.Publisher("ar_pose_marker", AlvarMarkers, queue_size=1)
        rospy.Subscriber("camera/color/camera_info", CameraInfo, self._on_info, queue_size=1)
        rospy.Subscriber("camera/color/image_raw", Image, self._on_image, queue_size=1, buff_size=1 << 24)

    def _on_info(self, info):
        self._matrix = np.reshape(info.K, (3, 3))

    def _on_image(self, image):
        if self._matrix is None:
            return
        pixels = np.ndarray((image.height, image.width, 3), np.uint8, image.data, strides=(image.step, 3, 1))
        grey = cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)
        found = self._detector.find(grey, self._matrix)
        if found:
            self._broadcaster.sendTransform([self._frame(image.header, *one) for one in found.items()])
        if AlvarMarkers:
            self._publish(image.header, found)

    def _frame(self, header, number, placed):
        frame = TransformStamped(header=header, child_frame_id=f"{self._prefix}tag_{number}")
        fill(frame.transform.translation, frame.transform.rotation, *placed)
        return frame

    def _publish(self, header, found):
        """As ar_track_alvar does, also where nothing is found."""
        message = AlvarMarkers()
        message.header.stamp, message.header.frame_id = header.stamp, self._prefix + "camera_link"
        for number, (rotation, place) in found.items():
            marker = AlvarMarker(header=message.header, id=number)
            marker.pose.header = message.header
            turned = cv2.Rodrigues(OPTICAL @ cv2.Rodrigues(rotation)[0])[0].ravel()
            fill(marker.pose.pose.position, marker.pose.pose.orientation, turned, OPTICAL @ place)
            message.markers.append(marker)
        self._markers.publish(message)


def fill(translation, orientation, rotation, place):
    """Write a rotation vector [rad] and a place [m] into a message's parts."""
    angle = np.linalg.norm(rotation)
    translation.x, translation.y, translation.z = place
    orientation.x, orientation.y, orientation.z = rotation * np.sinc(angle / 2 / np.pi) / 2
    orientation.w = np.cos(angle / 2)


def main():
    """Run tags_node."""
    run_without_wheels("tags_node", TagsNode, PARAMETERS)

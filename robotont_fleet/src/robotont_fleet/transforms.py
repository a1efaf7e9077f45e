"""The robot's place out of /tf: only the frames between the map and the robot, as seldom as wanted; free of ROS."""

from copy import deepcopy

from robotont_driver.kinematics.se2 import compose, yaw_of

STALE = 1.0       # [s] a transform that has not come for so long is no place
MOST_FRAMES, DEEPEST = 500, 10


class Chain:
    """The newest transforms by child frame. base: the robot's frame; prefix: of frames' names, which is taken off."""

    def __init__(self, base, prefix=""):
        self._base = base
        self._prefix = prefix
        self._newest = {}  # child frame: (transform, when it came [s], whether it is fixed)

    def hear(self, transforms, now, fixed=False):
        """Transforms came at time `now` [s]; fixed: on /tf_static."""
        for transform in transforms:
            if transform.child_frame_id in self._newest or len(self._newest) < MOST_FRAMES:
                self._newest[transform.child_frame_id] = (transform, now, fixed)

    def links(self, now):
        """[(transform, fixed)] from the robot up to the outermost frame; [] where its odometry is silent."""
        found, frame = [], self._base
        while frame in self._newest and len(found) < DEEPEST:
            transform, at, fixed = self._newest[frame]
            if not fixed and now - at > STALE and all(was_fixed for _, was_fixed in found):  # the odometry's
                return []
            found.append((transform, fixed))
            frame = transform.header.frame_id
        return found

    def pose(self, now):
        """(frame, (x [m], y [m], yaw [rad])) of the robot in the outermost frame, or ("", None)."""
        links = self.links(now)
        if not links:
            return "", None
        pose = (0.0, 0.0, 0.0)
        for transform, _ in links:
            pose = compose(displacement(transform), pose)
        return self._plain(links[-1][0].header.frame_id), pose

    def named(self, transform, fixed, stamp):
        """A copy with the names that free_fleet expects; a fixed one gets the stamp of those that move."""
        transform = deepcopy(transform)
        transform.header.frame_id = self._plain(transform.header.frame_id)
        transform.child_frame_id = self._plain(transform.child_frame_id)
        if fixed:
            transform.header.stamp = stamp
        return transform

    def _plain(self, frame):
        frame = frame.lstrip("/")
        return frame[len(self._prefix):] if frame.startswith(self._prefix) else frame


def displacement(transform):
    """(x, y, yaw) of a TransformStamped."""
    place = transform.transform.translation
    return place.x, place.y, yaw_of(transform.transform.rotation)

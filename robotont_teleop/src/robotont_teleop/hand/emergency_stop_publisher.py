"""The emergency stop as a node for driving by hand sees and presses it; `emergency_stop` of the driver has the rule."""

import threading

import rospy
from std_msgs.msg import Bool, String

from robotont_driver.link.boot_clock import boot_time
from robotont_driver.rospy_repairs.rospy_internals import connection_header
from robotont_teleop.hand.service_request import ServiceRequest

HELD = 1.0  # [s] for which a person holds the button of a release: one that ends a younger press was begun before it


class EmergencyStopPublisher:
    """Presses for this node, follows driver_node's word of who presses, and asks it for a release.

    A press stays latched, for a driver_node that starts or connects later, until driver_node has it released.
    failed(words): called when a request for a release has failed.
    """

    def __init__(self, failed=lambda words: None):
        self._failed = failed
        self._lock = threading.RLock()
        self.pressed_by = ""       # as driver_node has said
        self.latched = False       # whether this node presses
        self._named = None         # connection on which driver_node has named this node since its newest press
        self.pressed_at = boot_time()  # [s] newest press; before the start of this node nothing was seen
        self._younger = -HELD      # [s] newest own press, which no own release has followed
        self._release = ServiceRequest(
            "emergency_stop/release", "release of the emergency stop", self._not_released,
            lambda asked: "it was pressed again meanwhile" if self.pressed_at > asked else "", self._released,
            lambda: f"{rospy.get_name()}, {self.pressed_by}")
        self._publisher = rospy.Publisher("emergency_stop", Bool, queue_size=5, tcp_nodelay=True, latch=True)
        self._words = rospy.Subscriber("emergency_stop/pressed_by", String, self._on_pressed_by, queue_size=5,
                                       tcp_nodelay=True)

    @property
    def has_driver(self):
        """Whether a driver_node is there to hear of it."""
        return self._words.get_num_connections() > 0

    @property
    def pressed(self):
        """Whether the robot stands by it, or will as soon as driver_node hears of it."""
        return bool(self.pressed_by) or self.latched

    @property
    def waits(self):
        """Whether this node presses and driver_node has not said yet that the robot stands by it.

        That it stands by another's press is not enough: that one may have ended meanwhile.
        """
        return self.latched and not self._is_named()

    def press(self):
        """Stop the robot until a person releases it."""
        with self._lock:
            self._younger = boot_time()
            self._press()

    def _press(self):
        self.latched = True
        if not self._is_named():
            self._named = None
        self.pressed_at = boot_time()
        self._publisher.publish(True)

    def release(self):
        """Ask driver_node to let commands move the robot, not late, nor over a press not seen here; returns at once."""
        self._younger = -HELD
        self._release.call()

    def _not_released(self, words):
        rospy.logerr("%s", words)
        self._failed(words)

    def _released(self, asked):
        with self._lock:
            if self.pressed_at > asked:
                self._press()
            else:
                self._unlatch()

    def _on_pressed_by(self, message):
        with self._lock:
            if message.data and message.data != self.pressed_by:
                self.pressed_at = boot_time()
            self.pressed_by = message.data
            if self._is_named():
                self._named = connection_header(message)
            elif self._named is connection_header(message):
                if boot_time() - self._younger < HELD:
                    self._press()
                else:
                    self._unlatch()

    def _is_named(self):
        return rospy.get_name() in self.pressed_by.split(", ")

    def _unlatch(self):
        """Behind a release: who connects from now on hears no press. A latched `false` releases nothing."""
        if self.latched:
            self.latched = False
            self._publisher.publish(False)

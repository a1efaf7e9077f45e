"""goto, as a user runs it, against a stand-in for move_base."""

from pathlib import Path

from geometry_msgs.msg import Twist

from robotont_testing import places
from robotont_testing.harness import Processes, wait_for
from robotont_testing.node_test import NodeTest

DOUBLE = Path(__file__).resolve().parent / "move_base_double.py"
SHARED = "/shared"  # namespace of the one stand-in that drives on until its goal is cancelled


class GotoTest(NodeTest):
    """Tests that end their server have a namespace of their own, so that nothing of it is left to others."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.server = Processes()
        cls.server.start(DOUBLE, f"__ns:={SHARED}", "_repeat:=true", log=cls.server.folder / "log")

    @classmethod
    def tearDownClass(cls):
        text = (cls.server.folder / "log").read_text()
        cls.server.close()
        assert "Traceback" not in text, text

    def setUp(self):
        super().setUp()
        self.use(SHARED)

    def use(self, space):
        """Watch a namespace, and run goto in it."""
        self.space = space
        self.commands = self.listen(space + "/cmd_vel", Twist)

    def start_server(self, space, **parameters):
        self.use(space)
        words = [f"_{name}:={value}" for name, value in parameters.items()]
        return self.processes.start(DOUBLE, f"__ns:={space}", *words)

    def start_goto(self, *words, log="goto"):
        self.log = self.processes.folder / log
        words = (*words, f"__ns:={self.space}")
        return self.processes.start(places.program("robotont_map_navigation", "goto"), *words, log=self.log)

    def end(self, process, timeout=30.0):
        """(exit status, lines) of goto when it has ended."""
        wait_for(lambda: process.poll() is not None, "the end of goto", timeout)
        text = self.log.read_text()
        self.assertNotIn("Traceback", text)
        return process.returncode, text.splitlines()

    def moving(self):
        return any(message.linear.x for message in self.commands)

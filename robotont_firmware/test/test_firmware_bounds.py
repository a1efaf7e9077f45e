"""Every intermediate value of the pure modules stays below 2^30, and none is a float.

The modules are compiled with each arithmetic operation wrapped in a check, then run with worst-case inputs.
"""

import ast
import copy
import importlib
import itertools
import json
import random
import sys
import types
from unittest import mock

import pytest
from firmware_tools import DUAL, GOLDEN, SRC

from robotont_firmware import config
from robotont_firmware.robot_numbers import Numbers

sys.path.append(str(DUAL))
from dual_tools import Config, WildBoard, checked

BOUND = 1 << 30
LINES = [checked(units) for units in (
    "0:0:0", "999.999:-999.999:999.999", "-999.999:999.999:0.004", "3:-3:0.003907")]
MODULES = ("protocol", "setpoints", "fault_watch", "status", "wheel_speed", "main_loop")


class Watch:
    largest = 0

    def __call__(self, value, where):
        if isinstance(value, (str, bytes, list, bool)):  # text for the banner, made before the loop
            return value
        assert isinstance(value, int), f"{value!r} at {where}"
        assert abs(value) < BOUND, f"{value} at {where}"
        self.largest = max(abs(value), self.largest)
        return value


class Wrap(ast.NodeTransformer):
    """Put `_watch(value, "module:line")` around every operation; `a += b` becomes `a = _watch(a + b)`."""

    def __init__(self, module):
        self.module = module

    def _wrap(self, node):
        where = ast.Constant(value=f"{self.module}:{node.lineno}", kind=None)
        call = ast.Call(func=ast.Name(id="_watch", ctx=ast.Load()), args=[node, where], keywords=[])
        return ast.copy_location(call, node)

    def visit_BinOp(self, node):
        return self._wrap(self.generic_visit(node))

    def visit_UnaryOp(self, node):
        node = self.generic_visit(node)
        return node if isinstance(node.op, ast.Not) else self._wrap(node)

    def visit_AugAssign(self, node):
        self.generic_visit(node)
        source = copy.deepcopy(node.target)
        source.ctx = ast.Load()
        value = ast.copy_location(ast.BinOp(left=source, op=node.op, right=node.value), node)
        return ast.copy_location(ast.Assign(targets=[node.target], value=self._wrap(value)), node)


@pytest.fixture
def watched():
    """(watch, modules): the pure modules, instrumented, in place of the plain ones."""
    watch, modules = Watch(), types.SimpleNamespace()
    with mock.patch.dict(sys.modules):
        for name in [name for name in sys.modules if name.split(".")[0] == "robotont_firmware"]:
            del sys.modules[name]
        for name in MODULES:
            source = (SRC / "robotont_firmware" / (name + ".py")).read_text()
            tree = ast.fix_missing_locations(Wrap(name).visit(ast.parse(source)))
            module = sys.modules["robotont_firmware." + name] = types.ModuleType("robotont_firmware." + name)
            module._watch = watch
            exec(compile(tree, name + ".py", "exec"), module.__dict__)
            setattr(modules, name, module)
        modules.bounds = importlib.import_module("robotont_firmware.robot_numbers")
        yield watch, modules


def test_packets_stay_in_bounds(watched):
    watch, modules = watched
    golden = json.loads(GOLDEN.read_text())
    lines = [vector[kind] for vector in golden["commands"] for kind in ("plain", "checked")]
    lines += golden["bad_commands"]
    lines += ["999.999999999:-999.9999999999:%s;\n" % ("9" * 100), "0.999999:-0.999999:999.999999;\n"]
    for line, wheels in itertools.product(lines, (3, 4, 5)):
        modules.protocol.Receiver(wheels).feed(line.encode(), len(line))
    receiver = modules.protocol.Receiver(3)
    receiver.dropped = 254  # just before it starts again from 0
    for _ in range(3):
        receiver.feed(b"?\n", 2)
    assert receiver.dropped == 1
    rng = random.Random(1)
    for _ in range(300):
        data = bytes(rng.choice(b"0123456789.-:;\nF\xff") for _ in range(300))
        receiver.feed(data, len(data))
    sender = modules.protocol.Sender(3)
    for value in (-32768, 32767):
        sender.pack(255, [value] * 3, [65535] * 3, [255] * 8)
    assert watch.largest > 1 << 26  # the fraction's rounding was reached


class Drive:
    """Drives of 220 periods on a WildBoard with the instrumented modules."""

    def __init__(self, modules):
        self.modules, self.numbers = modules, Config()

    def accepts(self, name, value):
        """Whether the configuration is accepted with that value, which it then has."""
        before = getattr(self.numbers, name)
        setattr(self.numbers, name, value)
        try:
            self.modules.bounds.check(self.numbers)
        except ValueError:
            setattr(self.numbers, name, before)
            return False
        return True

    def push(self, name, sign):
        """Move a number as far as it is accepted, up or down."""
        for power in range(30, -1, -1):
            self.accepts(name, getattr(self.numbers, name) + sign * (1 << power))

    def run(self):
        controller = self.modules.main_loop.Controller(WildBoard(LINES), self.numbers, reset_cause="test")
        controller.start()
        controller.run()


TUNED = [name for name in vars(config) if isinstance(getattr(config, name), int) and name.isupper() and name not in (
    "WHEELS", "TICK_TIMER", "UART", "BAUDRATE", "WATCHDOG", "PWM_FREQUENCY", "ENCODER_PULL_UPS", "BATTERY_DIVIDER")]


@pytest.mark.parametrize("sign", [1, -1])
def test_with_each_number_at_its_edge_the_loop_stays_in_bounds(watched, sign):
    watch, modules = watched
    for name in TUNED:
        drive = Drive(modules)
        drive.push(name, sign)
        drive.run()
    together = Drive(modules)
    for name in TUNED:
        together.push(name, sign)
    together.run()
    assert watch.largest > 1 << 26


@pytest.mark.parametrize("rate", [2, 3, 5, 10, 50])
def test_a_reversal_from_full_speed_stays_in_bounds(watched, rate):
    numbers = watched[1].bounds.Numbers(Config(RATE=rate))
    setpoints = watched[1].setpoints.Setpoints(3, numbers)
    for wheel, way in enumerate((1, -1, 1)):
        setpoints.now[wheel], setpoints.targets[wheel] = way * numbers.max_speed, -way * numbers.max_speed
    before = list(setpoints.now)
    setpoints.advance()
    for old, new in zip(before, setpoints.now):
        assert abs(new - old) == pytest.approx(numbers.change, rel=1e-3)
        assert abs(new) < numbers.max_speed


@pytest.mark.parametrize("robots", [15, pytest.param(400, marks=pytest.mark.long)])
def test_random_robots_stay_in_bounds(watched, robots):
    """Any encoder, rate, gear, mass, motor and battery that is accepted."""
    rng, ran = random.Random(1), 0
    for _ in range(robots):
        drive = Drive(watched[1])
        for name, least, most in (*watched[1].bounds._RANGES, ("EDGES", 1, 1000000)):
            if name not in ("WHEELS", "BAUDRATE") and rng.random() < 0.5:
                part = rng.random()
                drive.accepts(name, round(least * (most / least) ** part) if least else round(most * part))
        drive.run()
        ran += 1
    assert ran == robots


def test_what_is_refused_would_leave_the_bounds(watched, monkeypatch):
    drive = Drive(watched[1])
    monkeypatch.setattr(watched[1].bounds, "check", lambda config: None)
    drive.numbers.MAX_LOAD = drive.numbers.MAX_EFFORT = 1 << 20
    with pytest.raises(AssertionError):
        drive.run()


def test_a_stop_leaves_an_eighth_of_the_torque_to_the_controller():
    """Without it wheels are cut off one by one, and the robot turns."""
    numbers = Numbers(config)
    needed = (max(numbers.lead, numbers.turn_lead) * numbers.braking >> 4) * numbers.gain >> 16
    assert 8 * needed <= 7 * config.MAX_TORQUE

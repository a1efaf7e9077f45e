"""Events of gamepads to twists."""

import pytest
from evdev import ecodes
from recorded_pads import PADS

from robotont_teleop.hand.gamepad import LAYOUTS, Gamepad, layout_for
from robotont_teleop.hand.speeds import STOP, Speeds

XBOX = LAYOUTS["xbox"]
OFF_CENTRE = 0.03  # [m/s] that a worn stick, not in its middle at rest, adds while the other axis drives


@pytest.fixture
def pad():
    ranges = {ecodes.ABS_X: (-32768, 32767), ecodes.ABS_Y: (-32768, 32767), ecodes.ABS_RX: (0, 255)}
    gamepad = Gamepad(XBOX, ranges, Speeds(0.2, 1.0), Speeds(0.5, 2.0), dead_zone=0.1)
    gamepad.event(ecodes.EV_ABS, ecodes.ABS_RX, 128)
    return gamepad


def test_a_stick_that_was_deflected_before_the_button_must_be_let_go(pad):
    pad.event(ecodes.EV_ABS, ecodes.ABS_Y, -32768)
    pad.event(ecodes.EV_KEY, ecodes.BTN_TL, 1)
    assert pad.twist == STOP
    pad.event(ecodes.EV_ABS, ecodes.ABS_Y, 0)
    pad.event(ecodes.EV_ABS, ecodes.ABS_Y, -32768)
    assert pad.twist[0] == pytest.approx(0.2)


def test_emergency_stop(pad):
    assert pad.event(ecodes.EV_KEY, ecodes.BTN_EAST, 1) == "stop"
    assert pad.event(ecodes.EV_KEY, ecodes.BTN_EAST, 0) is None
    assert pad.event(ecodes.EV_KEY, ecodes.BTN_START, 1) is None, "without the dead-man button"
    pad.event(ecodes.EV_KEY, ecodes.BTN_TL, 1)
    assert pad.event(ecodes.EV_KEY, ecodes.BTN_START, 1) == "release"


@pytest.mark.parametrize("name", LAYOUTS)
def test_layouts_are_recognised(name):
    layout = LAYOUTS[name]
    axes = [(axis, None) for axis in {*layout.axes, ecodes.ABS_Z}]
    found = layout_for({ecodes.EV_ABS: axes, ecodes.EV_KEY: layout.buttons})
    assert LAYOUTS[found] == layout


def test_the_state_after_lost_events_replaces_all(pad):
    pad.event(ecodes.EV_KEY, ecodes.BTN_TL, 1)
    pad.event(ecodes.EV_ABS, ecodes.ABS_Y, -32768)
    assert pad.twist != STOP
    assert pad.replace({ecodes.ABS_X: 0, ecodes.ABS_Y: -32768, ecodes.ABS_RX: 128}, [ecodes.BTN_TL]) is None
    assert pad.twist == STOP, "the sticks have not been in the middle since"
    assert pad.replace({ecodes.ABS_X: 0, ecodes.ABS_Y: 0, ecodes.ABS_RX: 128}, [ecodes.BTN_TL]) is None
    pad.event(ecodes.EV_ABS, ecodes.ABS_Y, -32768)
    assert pad.twist[0] == pytest.approx(0.2)
    assert pad.replace({ecodes.ABS_X: 0, ecodes.ABS_Y: 0, ecodes.ABS_RX: 128}, []) is None
    pad.event(ecodes.EV_ABS, ecodes.ABS_Y, -32768)
    assert pad.twist == STOP, "the dead-man button was let go of"
    assert pad.replace({}, [ecodes.BTN_EAST]) == "stop"


@pytest.mark.parametrize("model", PADS.values(), ids=PADS)
def test_real_pads_drive_as_they_are_held(model):
    name = layout_for(model.capabilities)
    pad = Gamepad(LAYOUTS[name], {code: (info.min, info.max) for code, info in model.axes.items()}, Speeds(0.3, 1.0),
                  Speeds(0.8, 2.0), dead_zone=0.1)
    pad.replace({code: info.value for code, info in model.axes.items()}, [])
    for button in set(model.buttons) - LAYOUTS[name].buttons:
        assert pad.event(ecodes.EV_KEY, button, 1) is None
    for trigger in model.triggers:
        info = model.axes[trigger]
        for value in (info.max // 2, info.max, info.value):
            pad.event(ecodes.EV_ABS, trigger, value)
            assert pad.twist == STOP
    right, down = model.left_stick
    turn = model.right_stick
    pad.event(ecodes.EV_KEY, model.left_shoulder, 1)
    pad.event(ecodes.EV_ABS, down, model.axes[down].min)
    assert pad.twist == pytest.approx((0.3, 0.0, 0.0), abs=OFF_CENTRE)
    pad.event(ecodes.EV_ABS, down, model.axes[down].value)
    pad.event(ecodes.EV_ABS, right, model.axes[right].max)
    pad.event(ecodes.EV_ABS, turn, model.axes[turn].min)
    assert pad.twist == pytest.approx((0.0, -0.3, 1.0), abs=OFF_CENTRE)
    pad.event(ecodes.EV_KEY, model.right_shoulder, 1)
    assert pad.twist == pytest.approx((0.0, -0.8, 2.0), abs=3 * OFF_CENTRE)
    for stick in (right, turn):
        pad.event(ecodes.EV_ABS, stick, model.axes[stick].value)
    assert pad.twist == STOP
    assert pad.event(ecodes.EV_KEY, model.right_hand_button, 1) == "stop"

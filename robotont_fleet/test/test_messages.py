"""What pages and robots say to each other: orders and states, as JSON."""

import json
import math

import pytest
from fleet_rig import STATE
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from robotont_fleet.messages import TO_PAGE, TO_ROBOT, read_order, read_state
from robotont_teleop.web.metrics import metrics

GOAL = {"kind": "goal", "name": "r1", "id": "a", "seen": 7, "x": 0.5, "y": -3}


@pytest.mark.parametrize("payload", [
    "", "[]", "{}", "null", '"stop"', b"\xff", "[" * 500, '{"kind": "drive"}', '{"kind": ["stop"]}',
    '{"kind": "cancel"}', '{"kind": "stop", "name": [1]}', json.dumps({"kind": "stop", "name": "r" * 600}),
    *(json.dumps({**GOAL, key: value}) for key, value in (("x", math.nan), ("x", 1000.1), ("y", None), ("x", True),
                                                           ("seen", math.inf), ("seen", 10 ** 400), ("id", 3)))])
def test_what_is_no_order_is_refused(payload):
    with pytest.raises(ValueError, match="no order"):
        read_order(payload if isinstance(payload, bytes) else payload.encode(), TO_PAGE)


ODD = st.none() | st.text() | st.floats() | st.sampled_from([10 ** 400, True]) | st.lists(
    st.floats() | st.text(), max_size=4) | st.dictionaries(st.text(max_size=8), st.floats() | st.text(), max_size=2)


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.binary(max_size=200) | st.dictionaries(st.sampled_from(sorted(STATE)), ODD).map(
    lambda fields: json.dumps({**STATE, **fields}).encode()))
@example(json.dumps({**STATE, "id": "half \ud800"}).encode())
def test_whatever_is_said_becomes_sound_json_or_nothing(payload):
    for read in (read_state, lambda text: read_order(text, TO_ROBOT)):
        try:
            found = read(payload)
        except ValueError:
            continue
        assert json.loads(json.dumps(found, allow_nan=False)) == found
        assert read is not read_state or found["page"] == "" or found["page"].startswith(("http://", "https://"))
        if read is read_state:
            metrics([{**found, "name": "r1", "up": True, "age": 0.0}], {})

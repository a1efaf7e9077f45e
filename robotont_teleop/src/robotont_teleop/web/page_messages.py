"""The messages of a page: one JSON object each, every field checked; free of network."""

import json
from typing import NamedTuple, Optional, Tuple

LARGEST_SPEED = 100.0  # [m/s, rad/s] a larger number is a fault of the sender
LARGEST_TIME = 2 ** 53  # [ms] largest integer of a browser
FARTHEST = 1000.0      # [m] of a goal

FIELDS = {  # kind: largest absolute value of each field
    "drive": {"time": LARGEST_TIME, "x": LARGEST_SPEED, "y": LARGEST_SPEED, "turn": LARGEST_SPEED},
    "goal": {"time": LARGEST_TIME, "x": FARTHEST, "y": FARTHEST},
    **{kind: {"time": LARGEST_TIME} for kind in ("take", "give_back", "reset_odometry")},
    "release": {"time": LARGEST_TIME, "pressed_at": LARGEST_TIME},
    "stop": {}, "cancel": {},  # hold however late they come
}


class MessageError(ValueError):
    """A message that is not one of ours; states the found and the allowed values."""


class Message(NamedTuple):
    """One message of a page."""

    kind: str
    seen: Optional[float] = None  # [s] the newest server time that the page had seen
    values: Tuple[float, ...] = ()  # drive: (v_x [m/s], v_y [m/s], omega [rad/s]); goal: (x [m], y [m])
    # release: ([s] of the newest press that the person has seen, as the state tells it)


def read_message(text):
    """Message of a text or its bytes; raises MessageError and nothing else, whatever they are."""
    try:
        fields = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MessageError(f"no JSON: {error}") from None
    kind = fields.pop("kind", None) if isinstance(fields, dict) else None
    if not isinstance(kind, str) or kind not in FIELDS:
        raise MessageError(f"found kind {kind!r}, allowed: {', '.join(FIELDS)}")
    allowed = FIELDS[kind]
    if set(fields) != set(allowed):
        raise MessageError(f"{kind}: found {sorted(fields)}, allowed: {sorted(allowed)}")
    for name, largest in allowed.items():
        value = fields[name]
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not -largest <= value <= largest:
            raise MessageError(f"{kind}: found {name} {value!r:.40}, allowed: numbers from {-largest:g} to {largest:g}")
    values = tuple(float(fields[name]) for name in ("x", "y", "turn", "pressed_at") if name in allowed)
    return Message(kind, fields["time"] / 1000.0 if "time" in allowed else None, values)

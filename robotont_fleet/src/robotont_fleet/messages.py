"""What robots and pages send each other as JSON, of which nothing else than expected is believed; free of network."""

import json

LARGEST_ORDER, LARGEST_STATE = 512, 16384  # [bytes]
LONGEST = 200       # letters of a word
MOST = 1e15         # beyond, a number is none: not each of 400 digits fits into a float
FARTHEST = 1000.0   # [m] of a goal
DRIVERS = ("hand", "navigation", "default")  # that the mux lets nobody drive does not say that no program does past it
CONFIRMED = 8       # stops that a robot can stand by at the same time, of as many pages
# The kinds of orders with what each must name, from a browser to the page's server, and from there to a robot
TO_PAGE = {"stop": (), "release": ("newest",), "cancel": ("name",), "goal": ("name", "id", "seen", "x", "y")}
TO_ROBOT = {"stop": ("number",), "release": ("number", "id", "seen"), "cancel": (), "goal": ("id", "seen", "x", "y")}
NONE = (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError)  # of what is no message


def read_order(payload, kinds):
    """{"kind", and what it must name}, of the `kinds` TO_PAGE or TO_ROBOT. Raises ValueError where it is no order.

    payload: bytes, or what zenoh has for them.
    """
    try:
        given = _load(payload, LARGEST_ORDER)
        order = {field: READERS[field](given[field]) for field in kinds[given["kind"]]}
        if given.get("name") is not None:
            order["name"] = _word(given["name"])
    except NONE as error:
        raise ValueError(f"no order: {error!r}") from None
    return {"kind": given["kind"], **order}


def read_state(payload):
    """What a robot says of itself (`state` of fleet_node). Raises ValueError where it is no state."""
    try:
        given = _load(payload, LARGEST_STATE)
        worst, battery = given["worst"], given["battery"]
        return {"id": _text(given["id"]), "number": _whole(given["number"]), "frame": _text(given["frame"]),
                "pose": _numbers(given["pose"], 3), "speed": _numbers(given["speed"], 2),
                "driven": number(given["driven"]),
                "driven_by": given["driven_by"] if given["driven_by"] in DRIVERS else "",
                "driver": given["driver"] is True, "stopped": _text(given["stopped"]),
                "confirmed": [_word(one) for one in given["confirmed"][:CONFIRMED]],
                "worst": worst and {"level": _whole(worst["level"]), **{
                    field: _text(worst[field]) for field in ("task", "words", "fault")}},
                "battery": battery and {field: number(battery.get(field)) for field in ("voltage", "charge")},
                "page": given["page"] if str(given["page"]).startswith(("http://", "https://")) else "",
                "note": _text(given["note"]), "namesakes": _whole(given["namesakes"])}
    except NONE as error:
        raise ValueError(f"no state: {error!r}") from None


def _load(payload, most):
    if len(payload) > most:
        raise ValueError("too long")
    return json.loads(bytes(payload))


def number(value):
    """The value where it is a finite number of a size that has a meaning, else None."""
    sound = isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= MOST
    return value if sound else None


def _numbers(values, amount):
    numbers = [number(value) for value in values or ()]
    return numbers if len(numbers) == amount and None not in numbers else None


def _whole(value):
    return int(number(value))  # of None: TypeError


def _metres(value):
    return float(number(value) if abs(value) <= FARTHEST else None)


def _word(value):
    if not isinstance(value, str) or len(value) > LONGEST:
        raise ValueError("no word")
    return value


def _text(value):
    return str(value)[:LONGEST]


READERS = {"name": _word, "newest": _word, "number": _word, "id": _word, "seen": _whole, "x": _metres, "y": _metres}

"""Figures of benchmarks: several rounds of one, beside its floor and its bound; a table. Pure.

A figure is a dictionary, so that JSON can hold it: `row` makes it and documents its keys.
"""

import math
import re
import statistics

_BOUND = re.compile(r"(<=|>=|<|=) (\d+(?:\.\d+)?)( x floor)?$")


def percentile(values, part):
    """The smallest of the values that at least `part` (0..1) of them do not exceed (nearest rank)."""
    ordered = sorted(values)
    if not ordered:
        raise ValueError("percentile of no values")
    return ordered[max(0, math.ceil(part * len(ordered)) - 1)]


def row(name, value, unit, floor=None, bound="", note="", subject=""):
    """One figure.

    value: a number, a list with one number per round, or None where there is nothing to measure. The row has the
    median, and `min`, `max` and `rounds` beside it. floor: that of what does nothing but relay in the same run, alike.
    bound: the aim, such as "<= 3", ">= 10", "= 0" or "<= 1.1 x floor". subject: what is measured, of several.
    """
    rounds = value if isinstance(value, list) else [] if value is None else [value]
    middle = statistics.median(rounds) if rounds else None
    if isinstance(floor, list):
        floor = statistics.median(floor) if floor else None
    return {"name": name, "subject": subject, "value": middle, "min": min(rounds, default=None),
            "max": max(rounds, default=None), "rounds": len(rounds), "unit": unit, "floor": floor, "bound": bound,
            "note": note}


def reached(line):
    """Whether a row's value keeps its bound; None where there is no bound, value or floor to say so."""
    match = _BOUND.match(line["bound"])
    if not match or line["value"] is None or (match.group(3) and line["floor"] is None):
        return None
    relation, limit, of_floor = match.groups()
    limit = float(limit) * (line["floor"] if of_floor else 1.0)
    value = line["value"]
    return {"<=": value <= limit, ">=": value >= limit, "<": value < limit, "=": value == limit}[relation]


def number(value):
    """A number in at most three significant digits, as text; empty for None."""
    if value is None:
        return ""
    if isinstance(value, int) or value == int(value):
        return str(int(value))
    return f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"


def spread(line):
    """A row's value and, where there were several rounds, the smallest and largest."""
    if line.get("rounds", 1) < 2:
        return number(line["value"])
    return f"{number(line['value'])} ({number(line['min'])}-{number(line['max'])})"


def aim(line):
    """A row's bound and whether it is reached."""
    outcome = {True: ": yes", False: ": NO", None: ""}[reached(line)]
    return line["bound"] + outcome


def _cells(rows):
    yield "what", "of", "median (min-max)", "unit", "floor", "x floor", "aim", "note"
    for line in rows:
        times = number(line["value"] / line["floor"]) if line["value"] is not None and line["floor"] else ""
        yield (line["name"], line.get("subject", ""), spread(line), line["unit"], number(line["floor"]), times,
               aim(line), line["note"])


def text_table(rows):
    """The rows in columns for a terminal."""
    cells = list(_cells(rows))
    widths = [max(len(line[column]) for line in cells) for column in range(len(cells[0]))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip() for line in cells)

"""Run the benchmarks: a table on the terminal, and JSON on request.

run.py [--json FILE] [NAME ...]: names of bench_*.py without bench_; all without names.
"""

import argparse
import importlib
import json
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def names():
    """All benchmarks."""
    return sorted(path.stem[len("bench_"):] for path in HERE.glob("bench_*.py"))


def part(name, function):
    """Rows of one part, measured in a process of its own: a rospy node lives as long as its process."""
    result = subprocess.run([sys.executable, __file__, "--part", name, function], stdout=subprocess.PIPE, check=True)
    return json.loads(result.stdout.decode())


def figure(value):
    """A number in at most three significant decimals."""
    if value is None:
        return ""
    return str(value) if isinstance(value, int) else f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"


def table(rows):
    """The rows as text in columns."""
    head = ("what", "value", "unit", "floor", "bound", "note")
    cells = [head] + [
        (row["name"], figure(row["value"]), row["unit"], figure(row["floor"]), row["bound"], row["note"])
        for row in rows
    ]
    widths = [max(len(line[column]) for line in cells) for column in range(len(head))]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip() for line in cells)


def main():
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", metavar="FILE", help="write the rows there as well; - for standard output")
    parser.add_argument("--part", nargs=2, help=argparse.SUPPRESS)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(names())}; default: all")
    options = parser.parse_args()
    if options.part:
        module = importlib.import_module("bench_" + options.part[0])
        print(json.dumps(getattr(module, options.part[1])()))
        return
    unknown = set(options.names) - set(names())
    if unknown:
        parser.error(f"no such benchmark: {', '.join(sorted(unknown))}; there are: {', '.join(names())}")
    rows = []
    for name in options.names or names():
        for function in importlib.import_module("bench_" + name).PARTS:
            print(f"{name}: {function.__name__} ...", file=sys.stderr, flush=True)
            rows += part(name, function.__name__)
    if options.json == "-":
        print(json.dumps(rows, indent=1))
        return
    print(table(rows))
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:  # in each part, too: its rows are lost
        sys.exit(130)

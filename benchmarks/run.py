r"""Run benchmarks: a table here, JSON on request.

NAME is that of a bench_*.py without bench_, or one of its parts: driver,
driver.latency. Figures of driver and thumbs are medians of --rounds rounds,
in which all that is compared takes turns, with the smallest and the largest;
what is lost is the sum.
"""

import argparse
import importlib
import json
import sys
import traceback
from pathlib import Path

from robotont_testing.figures import text_table

FLOORS = {  # what stands in the column floor, of each benchmark
    "driver": "one rospy process that only relays",
    "motion": "of paths a board with the makers' firmware, up to its 0.3 m/s; of spins, and of headings at a stop, the "
              "same body on wheels whose speeds are held exactly",
    "thumbs": "sticks whose middle is fixed",
}
AIM = "aim: the bound that is wanted, and whether the figure keeps it; NO is no error: the benchmark ends well"
NAMES = sorted(path.stem[len("bench_"):] for path in Path(__file__).resolve().parent.glob("bench_*.py"))


def parts(names):
    """{name: function} of the benchmarks, and parts of them, that the command line gives. Raises LookupError."""
    found = {}
    for name in names:
        bench, _, part = name.partition(".")
        if bench not in NAMES:
            raise LookupError(f"no such benchmark: {bench}; there are: {', '.join(NAMES)}")
        functions = importlib.import_module("bench_" + bench).PARTS
        all_parts = {f"{bench}.{function.__name__.replace('bench_', '', 1)}": function for function in functions}
        if part and name not in all_parts:
            raise LookupError(f"no such part: {name}; there are: {', '.join(all_parts)}")
        found.update({name: all_parts[name]} if part else all_parts)
    return found


def parser():
    """Of the command line."""
    summary, _, description = __doc__.partition("\n\n")
    found = argparse.ArgumentParser(prog="./robotont bench", description=f"{summary}\n\n{description}",
                                    formatter_class=argparse.RawDescriptionHelpFormatter)
    found.add_argument("names", nargs="*", metavar="NAME", default=NAMES, help=f"one of {', '.join(NAMES)}, or "
                       "NAME.PART; default: all")
    found.add_argument("--json", metavar="FILE", help="write the rows there as well; - for standard output, alone")
    found.add_argument("--rounds", type=int, default=3, help="of driver and thumbs (3)")
    found.add_argument("--seconds", type=float, default=10.0, help="driver.latency: length of a round (10)")
    found.add_argument("--speeds", type=float, nargs="+", metavar="SPEED", default=(0.1, 0.3, 0.5, 0.8, 1.0),
                       help="motion: [m/s] (0.1 0.3 0.5 0.8 1)")
    found.add_argument("--picture", metavar="FILE", default="motion.png", help="motion.paths: draw there (motion.png)")
    return found


def main():
    """Parse the command line and run."""
    options = parser().parse_args()
    try:
        wanted = parts(options.names)
    except LookupError as error:
        parser().error(error.args[0])
    rows, failed = [], []
    for name, part in wanted.items():
        print(f"{name} ...", file=sys.stderr, flush=True)
        try:
            found = part(options)
        except Exception:
            traceback.print_exc()
            failed.append(name)
            continue
        rows += found
        if options.json != "-":
            print(text_table(found), flush=True)
    if rows and options.json != "-":
        for bench in dict.fromkeys(name.partition(".")[0] for name in wanted):
            print(f"floor ({bench}), measured alike in the same run: {FLOORS[bench]}")
        print(AIM)
    text = json.dumps(rows, indent=1)
    if options.json == "-":
        print(text)
    elif options.json:
        Path(options.json).write_text(text + "\n")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)

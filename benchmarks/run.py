r"""Run benchmarks: a table here; JSON, Markdown, a comparison on request.

NAME is that of a bench_*.py without bench_, or one of its parts: driver,
driver.latency. Each figure is the median of --rounds rounds, in which
everything that is compared takes turns, with the smallest and the largest.

--peer measures another driver in the same rounds: a command that starts any
node with cmd_vel in, odom out and a serial port, with a title for the tables
before it or without, e.g.

  ./robotont bench driver.latency --peer \
    "some driver: rosrun SOME_DRIVER SOME_NODE _port:={port}"
  ./robotont bench driver.latency --peer \
    "bash -c 'rosparam set port {port} && exec rosrun SOME_DRIVER SOME_NODE'"

{port} becomes the name of a pseudo-terminal, {namespace} that of the namespace
in which the node is started and in which the parameters of the wheels stand;
names that the node calls otherwise can be remapped as usual (drive:=cmd_vel).
Its board speaks --peer-board: plain (the thesis' packets), checked (this
project's), robotont2 (official firmware).
"""

import argparse
import importlib
import json
import subprocess
import sys
from pathlib import Path

from robotont_testing.figures import compare, markdown_table, text_table

HERE = Path(__file__).resolve().parent


def names():
    """All benchmarks."""
    return sorted(path.stem[len("bench_"):] for path in HERE.glob("bench_*.py"))


def parts(name):
    """{name: function} of one benchmark's parts."""
    functions = importlib.import_module("bench_" + name).PARTS
    return {f"{name}.{function.__name__.replace('bench_', '', 1)}": function for function in functions}


def chosen(given):
    """Names of all parts of the benchmarks and parts that the command line gives. Raises LookupError."""
    found = []
    for name in given:
        bench, _, part = name.partition(".")
        if bench not in names():
            raise LookupError(f"no such benchmark: {bench}; there are: {', '.join(names())}")
        if part and name not in parts(bench):
            raise LookupError(f"no such part: {name}; there are: {', '.join(parts(bench))}")
        found += [name] if part else parts(bench)
    return found


def measure(part, arguments):
    """Rows of one part, from a process of its own: a rospy node lives as long as its process. None: it failed."""
    command = [sys.executable, __file__, *arguments, "--part", part]
    result = subprocess.run(command, stdout=subprocess.PIPE, check=False)
    return json.loads(result.stdout.decode()) if result.returncode == 0 else None


def parser():
    """Of the command line."""
    summary, _, description = __doc__.partition("\n\n")
    found = argparse.ArgumentParser(prog="./robotont bench", description=f"{summary}\n\n{description}",
                                    formatter_class=argparse.RawDescriptionHelpFormatter)
    found.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(names())}, or NAME.PART; default: "
                       "all but growth")
    found.add_argument("--json", metavar="FILE", help="write the rows there as well; - for standard output, alone")
    found.add_argument("--markdown", metavar="FILE", help="write the table there as well")
    found.add_argument("--compare", metavar="OLD.json", help="show what has changed since")
    found.add_argument("--peer", metavar="COMMAND", action="append", default=[], help="see above; may be repeated")
    found.add_argument("--peer-board", default="plain", choices=("plain", "checked", "robotont2"))
    found.add_argument("--rounds", type=int, default=3)
    found.add_argument("--seconds", type=float, default=10.0, help="length of a round; growth: of a step (10)")
    found.add_argument("--burst", type=float, default=60.0, help="seconds of driver.throughput (60)")
    found.add_argument("--robots", type=int, default=20, help="growth: at most (20)")
    found.add_argument("--minutes", type=float, default=10.0, help="growth.endurance: for so long (10)")
    found.add_argument("--speeds", type=float, nargs="+", metavar="SPEED", default=(0.1, 0.3, 0.5, 0.8, 1.0),
                       help="motion: [m/s] (0.1 0.3 0.5 0.8 1)")
    found.add_argument("--picture", metavar="FILE", help="growth, motion.paths: draw there (growth.png, motion.png)")
    found.add_argument("--part", help=argparse.SUPPRESS)
    return found


def main():
    """Parse the command line and run."""
    options = parser().parse_args()
    if options.part:
        print(json.dumps(parts(options.part.partition(".")[0])[options.part](options)))
        return
    try:
        wanted = chosen(options.names or [name for name in names() if name != "growth"])
    except LookupError as error:
        parser().error(error.args[0])
    old = json.loads(Path(options.compare).read_text()) if options.compare else None
    rows, failed = [], []
    for part in wanted:
        print(f"{part} ...", file=sys.stderr, flush=True)
        found = measure(part, sys.argv[1:])
        rows += found or []
        failed += [part] if found is None else []
    if options.json == "-":
        print(json.dumps(rows, indent=1))
    else:
        report(rows, old, options)
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


def report(rows, old, options):
    """Table, comparison, picture and files."""
    print(text_table(rows))
    if old:
        print("\nSince " + options.compare + ":\n" + compare(old, rows))
    if any("at" in line for line in rows):
        importlib.import_module("bench_growth").draw(rows, options.picture or "growth.png")
    for file, text in ((options.json, json.dumps(rows, indent=1)), (options.markdown, markdown_table(rows))):
        if file:
            Path(file).write_text(text + "\n")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:  # in each part, too: its rows are lost
        sys.exit(130)

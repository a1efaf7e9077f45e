"""Arguments for launch files, before anything is built: prints those that were given, as name:=value, one per line.

launch_arguments.py COMMAND FILE[,FILE ...] OWN ... -- WORD ...: the arguments are those of the files, the first of
which counts where several have one; OWN are the command's defaults, where the files have others.
"""

# ruff: noqa: E402
import signal

signal.signal(signal.SIGINT, signal.SIG_DFL)  # no traceback

import sys
from pathlib import Path
from xml.etree import ElementTree

from robotont_driver.parameters.argument_parser import ArgumentParser

LAUNCH = Path(__file__).resolve().parents[3] / "launch"


def arguments(files):
    """{name: (default, its words)} of the arguments of launch files, but for those without words or with a value."""
    found = {}
    for file in files:
        for one in ElementTree.parse(str(LAUNCH / f"{file}.launch")).getroot().findall("arg"):
            if one.get("value") or one.get("doc"):
                found.setdefault(one.get("name"), (one.get("default"), one.get("doc")))
    return {name: (default, doc) for name, (default, doc) in found.items() if default is not None and doc}


def main():
    """Print what roslaunch gets."""
    command, files, *words = sys.argv[1:]
    own = dict(word.split(":=", 1) for word in words[:words.index("--")])
    words = words[words.index("--") + 1:]
    parser = ArgumentParser(prog=f"./robotont {command}", usage="%(prog)s [--NAME VALUE ...]",
                            epilog="NAME:=VALUE, as for roslaunch, means the same.")
    for name, (default, doc) in arguments(files.split(",")).items():
        shown = own.get(name) or ("computed" if "$(" in default else default or "empty")
        parser.add_argument("--" + name, metavar="VALUE", default=own.get(name),
                            help=f"{doc} [{shown}]".replace("%", "%%"))
    remappings = [word for word in words if word.startswith("__")]
    given = parser.parse_args([word for word in words if word not in remappings])
    print(*remappings, *(f"{name}:={value}" for name, value in vars(given).items() if value is not None), sep="\n")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Mutants of the fault rules: changes one thing at a time in fault_watch.py or config.py; which do the suites notice?

`./robotont test --mutants fault_watch` runs all, some 20 minutes. Comparisons and conditions are turned round, sums
become differences, numbers are doubled and halved, assignments to the wheel's memory left out.
"""

import ast
import copy
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from firmware_tools import SRC, run_suite

SUITES = ("suite_watch", "suite_faults", "suite_drives", "suite_controller", "suite_pid")
FUNCTIONS = ("direction", "reset", "bound", "look", "_is_uneven")
NUMBERS = ("_RISE", "_CLEAR_RISE", "_SETTLED", "_CHANGING", "_EVEN", "_FAST", "_KNOCK", "MAX_LOAD", "BLIND_TIME",
           "BLIND_SHARE", "CHANGING_SHARE", "BESIDE_SHARE", "WRONG_EDGES", "UNEVEN_SHARE", "UNEVEN_EDGES",
           "BLOCKED_INTEGRAL")  # fmt: skip
OPPOSITE = {ast.Lt: ast.GtE, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.GtE: ast.Lt, ast.Add: ast.Sub, ast.Sub: ast.Add,
            ast.And: ast.Or, ast.Or: ast.And, ast.LShift: ast.RShift, ast.RShift: ast.LShift}  # fmt: skip


def changes(node):
    """Yield functions that change a node of the tree in place."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in OPPOSITE:
        yield lambda: node.ops.__setitem__(0, OPPOSITE[type(node.ops[0])]())
    if isinstance(node, (ast.BinOp, ast.AugAssign, ast.BoolOp)) and type(node.op) in OPPOSITE:
        yield lambda: setattr(node, "op", OPPOSITE[type(node.op)]())
    if isinstance(node, ast.BoolOp):
        for index in range(len(node.values)):
            yield lambda index=index: node.values.pop(index)
    if isinstance(node, ast.IfExp):
        yield lambda: setattr(node, "test", ast.Constant(1, None))
        yield lambda: setattr(node, "test", ast.Constant(0, None))
    if isinstance(node, ast.Constant) and type(node.value) is int and node.value > 1:
        for value in (node.value * 2, node.value // 2):
            yield lambda value=value: setattr(node, "value", value)
    for field in ("body", "orelse"):
        statements = getattr(node, field, None)
        for index, statement in enumerate(statements if isinstance(statements, list) else ()):
            if isinstance(statement, (ast.AugAssign, ast.Assign)) and isinstance(
                    statement.target if isinstance(statement, ast.AugAssign) else statement.targets[0], ast.Subscript):
                yield lambda field=field, index=index: getattr(node, field).__setitem__(index, ast.Pass())


def parts(tree):
    """Return all nodes of the rules' functions and of their constants."""
    found = []
    for node in ast.walk(tree):
        if (isinstance(node, ast.FunctionDef) and node.name in FUNCTIONS) or (
                isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") in NUMBERS):
            found += ast.walk(node)
    return found


def mutants(source):
    tree = ast.parse(source)
    before = ast.unparse(tree).splitlines()
    for place, node in enumerate(parts(tree)):
        for number in range(len(list(changes(node)))):
            changed = copy.deepcopy(tree)
            list(changes(parts(changed)[place]))[number]()
            after = ast.unparse(changed)
            old, new = next(lines for lines in zip(before, after.splitlines()) if lines[0] != lines[1])
            yield old.strip(), new.strip(), after


def noticed(folder):
    """Return the test that fails with the sources in a folder, or "" when all pass."""
    for suite in SUITES:
        try:
            run = run_suite("micropython", suite, folder)
        except subprocess.TimeoutExpired:
            return "no end"
        if run.returncode != 0:
            return next((line.split()[1] for line in run.stdout.splitlines() if line.startswith("FAIL")), "no start")
    return ""


def main():
    """Run all; return 1 when one of them is not noticed."""
    package = SRC / "robotont_firmware"
    todo = [(file, *mutant) for file in ("fault_watch.py", "config.py")
            for mutant in mutants((package / file).read_text())]  # fmt: skip
    survivors = []
    with tempfile.TemporaryDirectory() as folder:
        there = Path(folder) / "robotont_firmware"
        shutil.copytree(str(package), str(there))
        assert not noticed(folder), "the suites fail without any change"
        for file, old, new, changed in todo:
            (there / file).write_text(changed)
            test = noticed(folder)
            what = f"{file}: {old}  ->  {new}"
            print(f"{what}: {test or 'NOT NOTICED'}", flush=True)
            survivors += [] if test else [what]
            shutil.copy(str(package / file), str(there / file))
    print(f"{len(todo)} mutants, {len(todo) - len(survivors)} noticed", *survivors, sep="\nnot noticed: ")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())

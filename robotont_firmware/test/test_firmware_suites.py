"""The suites in dual/ under CPython and under MicroPython; both must also find the same values."""

import ast
import functools

import pytest
from firmware_tools import DUAL, run_suite

SUITES = ["suite_protocol", "suite_pid", "suite_controller", "suite_watch", "suite_faults", "suite_fuzz",
          "suite_board", "suite_profiles", "suite_drives"]  # fmt: skip
TESTS = [
    f"{suite}.{node.name}"
    for suite in SUITES
    for node in ast.parse((DUAL / (suite + ".py")).read_text()).body
    if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
]


@functools.lru_cache(maxsize=None)
def results(interpreter):
    """Run each suite once, in a subprocess; return ({test: "ok" or output}, {test: value})."""
    output = "".join(run_suite(interpreter, suite).stdout for suite in SUITES)  # suite_board replaces modules
    found, values = {}, {}
    for line in output.splitlines():
        words = line.split(" ", 2)
        if words[0] == "ok":
            found[words[1]] = "ok"
        elif words[0] == "value":
            values[words[1]] = words[2]
    for test in TESTS:
        found.setdefault(test, output)
    return found, values


@pytest.mark.parametrize("test", TESTS)
@pytest.mark.parametrize("interpreter", ["cpython", "micropython"])
def test_suite(interpreter, test):
    assert results(interpreter)[0][test] == "ok"


def test_both_interpreters_find_the_same():
    assert results("cpython")[1]["suite_fuzz.test_random_and_mutated_bytes"].startswith("digest ")
    assert results("cpython")[1] == results("micropython")[1]

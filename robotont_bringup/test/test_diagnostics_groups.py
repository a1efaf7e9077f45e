"""config/diagnostics.yaml has each subject of our nodes' diagnostics in exactly one group."""

import ast
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
GROUPS = yaml.safe_load((ROOT / "config/diagnostics.yaml").read_text())["analyzers"]


def keys(node):
    return [key.value for key in node.keys if isinstance(key, ast.Constant)] if isinstance(node, ast.Dict) else []


def subjects():
    """Keys of what is handed to Health, there or by a variable."""
    for file in sorted(ROOT.glob("robotont_*/src/**/*.py")):
        tree = list(ast.walk(ast.parse(file.read_text())))
        for call in tree:
            if not (isinstance(call, ast.Call) and getattr(call.func, "id", "") == "Health"):
                continue
            if isinstance(call.args[1], ast.Dict):
                yield from keys(call.args[1])
            for assign in (one for one in tree if isinstance(one, ast.Assign)):
                target, name = assign.targets[0], getattr(call.args[1], "id", None)
                if name and getattr(target, "id", "") == name:
                    yield from keys(assign.value)
                elif name and isinstance(target, ast.Subscript) and getattr(target.value, "id", "") == name:
                    yield target.slice.value if isinstance(target.slice, ast.Constant) else target.slice.value.value


FOUND = sorted(set(subjects()))


def test_they_are_found():
    assert {"command stream", "link", "gyro", "stamps", "motion"} <= set(FOUND)


@pytest.mark.parametrize("subject", FOUND)
def test_a_subject_is_in_one_group(subject):
    assert len([name for name, group in GROUPS.items()
                if any(part in f"node: {subject}" for part in group["contains"])]) == 1

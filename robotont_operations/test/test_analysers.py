"""config/diagnostics.yaml: every task of our nodes' diagnostics is in exactly one group."""

import re

import yaml

from robotont_testing import places

NODES = ("robotont_driver", "robotont_map_navigation", "robotont_teleop", "robotont_operations", "robotont_simulator")


def tasks():
    """Names of all diagnostic tasks in the sources, as keys of what Health is given."""
    found = set()
    for package in NODES:
        for path in places.package(package).glob("src/**/*.py"):
            text = path.read_text()
            for keys in re.findall(r"Health\([^{]*\{([^}]*)\}", text) + re.findall(r"subjects = \{([^}]*)\}", text):
                found |= set(re.findall(r'"([a-z ]+)": (?:self\.|lambda)', keys))
            found |= set(re.findall(r'subjects\["([a-z ]+)"\]', text))
    return found


def test_each_task_is_in_one_group():
    groups = yaml.safe_load(places.config("diagnostics.yaml").read_text())["analyzers"]
    assert {"link", "command stream", "wheel feedback", "black box", "who drives"} <= tasks()
    for task in tasks():
        matching = [name for name, group in groups.items()
                    if any(part in f"node: {task}" for part in group["contains"])]
        assert len(matching) == 1, (task, matching)
    for group in groups.values():
        assert group["type"] == "diagnostic_aggregator/GenericAnalyzer"
        assert group["timeout"] > 1.0  # the nodes' period

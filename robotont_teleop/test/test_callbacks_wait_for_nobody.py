"""No callback of a command or a stop can reach a call that waits: for the master, another node, the disk or time.

Read from the sources: whatever a callback calls, by name, in the modules that its own imports. That is more than what
it can really call, never less but for functions that are handed over to be called elsewhere; those are ROOTS, too.
"""

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

SOURCES = [path for package in ("robotont_driver", "robotont_teleop") for path in
           (Path(__file__).resolve().parents[2] / package / "src" / package).rglob("*.py")]
WAITING = {"set_param", "get_param", "has_param", "delete_param", "search_param", "ServiceProxy", "wait_for_service",
           "wait_for_message", "getSystemState", "lookupService", "lookupNode", "get_master", "Master", "ServerProxy",
           "publisherUpdate", "open", "print", "input", "sleep", "join", "result", "rostopic", "run", "check_output"}
SUBSCRIBER = re.compile(r'Subscriber\("(?:cmd_vel|emergency_stop|serial_write)[^,]*, \w+, (?:partial\()?self\.(\w+)')
ROOTS = {  # beside those subscribers
    "driver_node.py": {"_on_release", "_repeat", "_stop"},
    "serial_com_node.py": {"on_packet"},
    "connection.py": {"feed", "encode", "stop"},  # in the thread of the link
    "cmd_vel_mux.py": {"_look", "_on_give_back"},
    "guard_sensors.py": {"_on_scan", "_on_range", "_on_static"},  # what they hold back holds back the mux' own threads
    "odom_node.py": {"_on_packet"},
    "emergency_stop_publisher.py": {"press"},
    "service_request.py": {"call"},
    "twist_publisher.py": {"send", "end"},
    "robot_view.py": {"cancel"},
    "camera.py": {"picture"},  # is asked for in the page's loop
    "web_server.py": {"receive", "remove", "_look"},
    "keyboard_teleop.py": {"_take", "_send", "stop"},
    "joy_watch.py": {"_on_joy"},
}


def name_of(node):
    """`c` of `c`, `a.c` and `a.b().c`; else None."""
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else None


class Module:
    """The text of a source, its functions, and the modules it imports."""

    def __init__(self, path):
        self.text, self.functions = path.read_text(), defaultdict(list)
        nodes = list(ast.walk(ast.parse(self.text)))
        for node in nodes:
            if isinstance(node, ast.FunctionDef):
                self.functions[node.name].append(node)
        self.imports = {name + ".py" for node in nodes if isinstance(node, ast.ImportFrom) and node.module
                        for name in (node.module.split(".")[-1], *(alias.name for alias in node.names))}


MODULES = {path.name: Module(path) for path in SOURCES}


def waits(file, function, seen):
    """The way from a function to a call that waits, as a list of words; empty where there is none."""
    if (file, function) in seen:
        return []
    seen.add((file, function))
    module = MODULES[file]
    within_reach = [file, *sorted(module.imports & set(MODULES))]
    for definition in module.functions.get(function, []):
        for call in (node for node in ast.walk(definition) if isinstance(node, ast.Call)):
            called, of = name_of(call.func), getattr(call.func, "value", None)
            here = f"{file}:{call.lineno} {function} calls {called}"
            if called in WAITING and not isinstance(of, ast.Constant):  # ", ".join(...)
                return [here]
            ways = (waits(other, called, seen) for other in within_reach if called in MODULES[other].functions)
            way = next(filter(None, ways), None)
            if way:
                return [here, *way]
    return []


LISTED = {(file, name) for file, names in ROOTS.items() for name in names}
FOUND = {(file, callback) for file, module in MODULES.items() for callback in SUBSCRIBER.findall(module.text)}


@pytest.mark.parametrize("file, function", sorted({*LISTED, *FOUND}))
def test_no_callback_of_a_command_or_a_stop_reaches_a_call_that_waits(file, function):
    assert function in MODULES[file].functions
    assert not waits(file, function, set())


def test_a_call_that_waits_and_a_subscriber_are_found():
    assert {("driver_node.py", "_on_command"), ("cmd_vel_mux.py", "_on_command")} <= FOUND
    assert "_write calls set_param" in waits("server_parameters.py", "_write", set())[0]

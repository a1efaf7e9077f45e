"""No callback of a command or a stop can reach a call that waits: for the master, another node, the disk or time.

Read from the sources: whatever a callback calls, by name, in the modules that its own imports. That is more than what
it can really call, never less but for functions that are handed over to be called elsewhere; those are ROOTS, too.
"""

import ast
from pathlib import Path

import pytest

SOURCES = [path for package in ("robotont_driver", "robotont_teleop") for path in
           (Path(__file__).resolve().parents[2] / package / "src" / package).rglob("*.py")]
WAITING = {"set_param", "get_param", "has_param", "delete_param", "search_param", "ServiceProxy", "wait_for_service",
           "wait_for_message", "getSystemState", "lookupService", "lookupNode", "get_master", "Master", "ServerProxy",
           "publisherUpdate", "open", "print", "input", "sleep", "join", "result", "rostopic", "run", "check_output"}
TOPICS = ("cmd_vel", "emergency_stop", "serial_write")  # a name that begins so
ROOTS = {  # beside the subscribers of such topics
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


class Module:
    """The functions of a source, the modules it imports, and the services that it calls like functions."""

    def __init__(self, path):
        self.tree = ast.parse(path.read_text())
        self.functions = {}
        for node in ast.walk(self.tree):
            if isinstance(node, ast.FunctionDef):
                self.functions.setdefault(node.name, []).append(node)
        self.imports = {name for node in ast.walk(self.tree) if isinstance(node, ast.ImportFrom) and node.module
                        for name in (node.module.split(".")[-1], *(alias.name for alias in node.names))}
        self.services = {name_of(target) for node in ast.walk(self.tree) if isinstance(node, ast.Assign)
                         and isinstance(node.value, ast.Call) and name_of(node.value.func) == "ServiceProxy"
                         for target in node.targets}


def name_of(node):
    """`c` of `c`, `a.c` and `a.b().c`; else None."""
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else None


MODULES = {path.name: Module(path) for path in SOURCES}


def waits(file, function, seen=None):
    """The way from a function to a call that waits, as a list of words; empty where there is none."""
    seen = set() if seen is None else seen
    if (file, function) in seen:
        return []
    seen.add((file, function))
    module = MODULES[file]
    within_reach = [file, *(name + ".py" for name in sorted(module.imports) if name + ".py" in MODULES)]
    for definition in module.functions.get(function, []):
        for call in (node for node in ast.walk(definition) if isinstance(node, ast.Call)):
            called = name_of(call.func)
            here = f"{file}:{call.lineno} {function} calls {called}"
            if (called in WAITING and not is_text(call)) or called in module.services:
                return [here]
            for other in within_reach:
                way = waits(other, called, seen) if called in MODULES[other].functions else []
                if way:
                    return [here, *way]
    return []


def is_text(call):
    """`", ".join(...)`, `os.path.join(...)`."""
    return isinstance(call.func, ast.Attribute) and (
        isinstance(call.func.value, ast.Constant) or name_of(call.func.value) == "path")


def text_of(node):
    """The text of a constant, or that with which a sum begins; else an empty one."""
    node = node.left if isinstance(node, ast.BinOp) else node
    return node.value if isinstance(node, ast.Constant) else ""


def subscribed():
    """(file, callback) of each subscriber of a command or a stop."""
    for file, module in MODULES.items():
        for call in (node for node in ast.walk(module.tree) if isinstance(node, ast.Call)):
            if name_of(call.func) == "Subscriber" and text_of(call.args[0]).startswith(TOPICS):
                callback = call.args[2]
                yield file, name_of(callback.args[0] if isinstance(callback, ast.Call) else callback)


LISTED = {(file, name) for file, names in ROOTS.items() for name in names}


@pytest.mark.parametrize("file, function", sorted({*LISTED, *subscribed()}))
def test_no_callback_of_a_command_or_a_stop_reaches_a_call_that_waits(file, function):
    assert function in MODULES[file].functions
    assert not waits(file, function)


def test_a_call_that_waits_and_a_subscriber_are_found():
    assert {("driver_node.py", "_on_command"), ("cmd_vel_mux.py", "_on_command")} <= set(subscribed())
    assert waits("service_request.py", "_answer")[-1].endswith("_answer calls wait_for_service")
    assert "_write calls set_param" in waits("server_parameters.py", "_write")[0]
    assert waits("cmd_vel_mux.py", "_look_for_others")

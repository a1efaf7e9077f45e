"""Feeds a parser with bytes that atheris (libFuzzer) makes to reach new code; ends with a traceback at a wrong error.

    fuzz_by_coverage.py PARSER FOLDER [options of libFuzzer]: the seeds lie in FOLDER, which also gets what reaches new
    code. The current folder gets a file `fuzzed` and the input that ended it.
"""

import sys
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["robotont_driver", "robotont_calibration", "robotont_simulator"]):
    from robotont_calibration.recordings import RecordingError, read_recording
    from robotont_driver.kinematics.wheel_params import read_wheels
    from robotont_driver.nodes import driver_node, odom_node, serial_com_node
    from robotont_driver.parameters.parameters import ParameterError, read_parameters
    from robotont_driver.parameters.yaml_file import read_mapping
    from robotont_driver.protocol.dialects import NAMES, make_dialect
    from robotont_driver.protocol.packet import Packet, PacketError, parse_packet
    from robotont_driver.robots.wheel_file import read_wheel_file
    from robotont_simulator.world import WorldError, read_world

from robotont_testing.robots import ROBOTONT2

REACH = 300  # [edges]
TOPICS = {"odometry": "odom", "packets": "serial_read", "commands": "cmd_vel"}
FILE = Path("fuzzed")


def write(data, suffix):
    """A file with these bytes."""
    file = FILE.with_suffix(suffix)
    file.write_bytes(data)
    return file


def packet(data):
    """A message on serial_write or serial_read."""
    try:
        found = parse_packet(data.decode("latin-1"), 3)
    except PacketError:
        return
    assert len(found) == 3
    assert max(map(abs, found)) < 1e7


def dialect(name):
    """Bytes from a board."""
    def feed(data):
        board = make_dialect(name, read_wheels(ROBOTONT2), REACH)
        board.connect(0.0)
        for number, line in enumerate(data.splitlines(keepends=True)):
            for found in board.feed(line, 0.02 * number):
                assert len(found) == 3
                assert max(map(abs, found)) <= REACH
            board.spoken.encode(Packet([1, -2, 3]))
            board.spoken.report_board()
            board.spoken.take_readings()
    return feed


def parameters(data):
    """Parameters of the nodes, as a file of YAML has them."""
    try:
        given, _ = read_mapping(write(data, ".yaml"), "parameters")
    except ValueError:
        return
    for node in (driver_node, odom_node, serial_com_node):
        try:
            read_parameters(node.PARAMETERS, given)
        except ParameterError as error:
            assert error.faults


def refuses(read, error_class, suffix, *arguments):
    """A reader of files that names the file in each error."""
    def feed(data):
        file = write(data, suffix)
        try:
            read(file, *arguments)
        except error_class as error:
            assert str(file) in str(error)
    return feed


PARSERS = {
    "packet": packet,
    **{name: dialect(name) for name in NAMES},
    "parameters": parameters,
    "wheel_file": refuses(read_wheel_file, ValueError, ".yaml"),
    "world": refuses(read_world, WorldError, ".yaml"),
    "csv": refuses(read_recording, RecordingError, ".csv", TOPICS),
    "optiodom": refuses(read_recording, RecordingError, ".csv", TOPICS, "optiodom"),
}

if __name__ == "__main__":
    parser = PARSERS[sys.argv.pop(1)]
    atheris.Setup(sys.argv, parser)
    atheris.Fuzz()

"""Whatever a file, the parameter server or a line contains: results, or the documented errors, and nothing else."""

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.checked import add_checksum
from robotont_driver.protocol.connection import NAMES, Connection
from robotont_driver.protocol.protocol import Packet
from robotont_driver.robots.robot_folder import read_wheel_file
from robotont_testing.robots import ROBOTONT2, WHEEL_PARAMS
from robotont_testing.spoilt import spoilt

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20)
    | st.integers().map(lambda n: n ** 9),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=5), inner, max_size=3), max_leaves=8)
LINES = (
    b"-18:0:18;07:0012:FFEE:0012:00000000:", b"1:2:3;\n", b"# robotont_firmware 2.0.0 wheels 3 rate 50\n",
    b"ODOM:0.100000:-0.200000:0.300000:0.010000:0.000000:0.500000\r\n", b"**** MAIN ****\r\n",
    b"RANGE:1:2:3:4:5:6:7:8:9:10:11:12\r\n", b"POWER:0.5:14.8\r\n", b"BATSTATE:0.1:0.2:16.0:15.0\n",
    b"Setpoints 1:2:3\r\nEncoders 1:2:3\r\n\r\n")


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=50)
@given(st.lists(st.tuples(st.sampled_from(LINES), st.integers(0, 2 ** 32)) | st.binary(max_size=300), max_size=30))
def test_connections(name, pieces):
    connection = Connection(read_wheels(ROBOTONT2), name)
    for number, piece in enumerate(pieces):
        now = 0.02 * number
        data = spoilt(*piece) if isinstance(piece, tuple) else piece
        if data.endswith(b":"):
            data = add_checksum(data[:-1].decode("latin-1").encode("ascii", "replace").decode() + ":")
        for packet in connection.feed(data, now):
            assert len(packet) == 3
            assert max(map(abs, packet)) <= 1.25 * 300
        for line in (connection.encode(Packet([1, -2, 3]), now), connection.stop(now), connection.last_stop()):
            assert len(line) < 64
        assert connection.state(now) in ("listening", "speaking")
        assert not (connection.obstacle and connection.complaint)
        if connection.protocol:
            connection.protocol.report_board()
            assert len(connection.protocol.encode_lights(0, [(1, 2, 3)])) <= 2


@given(st.integers(0, 2 ** 32).map(lambda seed: spoilt(WHEEL_PARAMS.read_bytes(), seed)) | st.binary(max_size=200)
       | VALUES.map(lambda value: yaml.safe_dump(value).encode()))
def test_files(tmp_path_factory, content):
    """By read_mapping, as all other files of YAML."""
    file = tmp_path_factory.getbasetemp() / "fuzz.yaml"
    file.write_bytes(content)
    try:
        wheels, _, _ = read_wheel_file(file)
    except ValueError as error:
        assert str(file) in str(error)
    else:
        assert wheels.amount >= 3

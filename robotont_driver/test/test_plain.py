"""The protocol of the thesis' packets: what is read and what is dropped."""

import pytest

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.protocol.plain import Plain
from robotont_testing.robots import SHIPPED


@pytest.mark.parametrize("data, packets, dropped", [
    (b"1:2:3;00:0001:0002:0003:0000\n4:5:6;\n", [(1, 2, 3), (4, 5, 6)], {}),
    (b"1:2.5:3;\n1:2:3.0;\n1:2:3;\n", [(1, 2, 3)], {"decimals": 2}),  # are no counts
    (b"\xff\n301:0:0;\n-300:0:0;\n", [(-300, 0, 0)], {"not ascii": 1, "reach": 1}),
    ((b"1" * 5000 + b"\n1:2:3;\r\n") * 2, [(1, 2, 3)] * 2, {"overlong": 2}),
])
def test_what_is_read_and_what_is_dropped(data, packets, dropped):
    plain = Plain(read_wheels(SHIPPED))
    lines = (b"# thesis\n" + data).splitlines(keepends=True)
    assert [packet for line in lines for packet in plain.feed(line, 0.0)] == packets
    assert plain.dropped == dropped
    assert plain.banner == "thesis"
    plain = Plain(read_wheels(SHIPPED))
    assert plain.feed(b"2:2:3;\n1:2:3;\n", 0.0) == [(1, 2, 3)], "the first line may lack its head"
    assert plain.dropped == {"first line": 1}

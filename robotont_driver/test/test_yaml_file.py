import os
import time

import pytest
import rosparam

from robotont_driver.parameters.yaml_file import read_mapping


@pytest.mark.parametrize("text", ["deg(45)", "rad(pi/4)", "!degrees 45", "!radians pi/4", "rad(-2*pi)", "deg(-1.5e1)",
                                  "rad(0.5*(1+pi))", "[deg(30), 1.0]", "!radians 0.785", "'text'", "1", "[1, 2.5]"])
def test_values_are_those_of_rosparam(tmp_path, text):
    file = tmp_path / "angles.yaml"
    file.write_text(f"value: {text}")
    assert read_mapping(file, "")[0] == rosparam.load_file(str(file))[0][0]


@pytest.mark.parametrize("text, words", [
    ("b: 1\na:0.04\nc: 1", "no YAML: a name without a colon and a blank behind it, in line 2"),
    ("a: !!timestamp x", "no YAML: 'x' is no timestamp, in line 1"),
    ("b: 1\na: !!int ''", "no YAML: '' is no int, in line 2"),
    ("a: 2026-13-45", "no YAML: '2026-13-45' is no timestamp, in line 1"),
    pytest.param("a: " + "9" * 5000, "", id="number"),
    ("a: 1\nb: 2\n'a': 3", "no YAML: a stands twice, in line 3"),
    ("b: {a: 1, a: 1}", "no YAML: a stands twice, in line 1"),
    ("a: deg(x)", "no YAML: 'deg(x)' is no degrees, in line 1"),
    ("a: rad(9**9**9)", "no YAML: 'rad(9**9**9)' is no radians, in line 1"),
    ("a: rad(1/0)", "is no radians, in line 1"),
    ("a: !foo 1", "in line 1"),
    ("a: 1\nb: [012]", "no YAML: found 012, which is 10 to YAML, allowed: a number, such as 12, in line 2"),
    ("a: -1:30.5", "found -1:30.5, which is -90.5 to YAML, allowed: a number, such as 30.5, in line 1"),
    ("a: &a [1, 1]\nb: [*a, *a]", "no YAML: an alias: write out what it stands for, in line 2"),
    ("a: &a {b: 1}\nc: {<<: *a}", "no YAML: an alias"),
    pytest.param("a: " + "[" * 6000 + "]" * 6000, "no YAML: maximum recursion depth", id="deep"),
    ("[1]", "found [1], allowed: two keys"),
    ("a: \x01", "unacceptable character #x0001"),
])
def test_what_is_no_yaml_of_people_is_refused_in_one_line_and_at_once(tmp_path, text, words):
    file = tmp_path / "wrong.yaml"
    file.write_text(text)
    started = time.process_time()
    try:
        read_mapping(file, "two keys")
    except ValueError as error:
        assert str(error).startswith(f"{file}: ")
        assert words in str(error)
        assert "\n" not in str(error)
    else:
        assert words == ""  # a Python that reads such a number
    assert time.process_time() - started < 2.0  # [s] and what repeats itself took 20


@pytest.mark.parametrize("text", ["0", "0.035", "0x40", "1_000", "00.5", "-0", "010.5", "!!float 1", "1:2x"])
def test_other_numbers_are_those_of_rosparam(tmp_path, text):
    test_values_are_those_of_rosparam(tmp_path, text)


def test_what_is_no_file_or_endless_is_refused_at_once(tmp_path):
    """A pipe waited for ever, a terminal as well, and a file of 1 MB took half a minute."""
    os.mkfifo(str(tmp_path / "pipe"))
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "long").write_text("".join(f"k{number}: 1\n" for number in range(20000)))
    for path in (tmp_path / "pipe", tmp_path, "/dev/ptmx", "/dev/zero", tmp_path / "loop", tmp_path / "long"):
        with pytest.raises(OSError, match="it is no file|symbolic links|it has more than 100000 bytes"):
            read_mapping(path, "")

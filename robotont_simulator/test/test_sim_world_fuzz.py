"""Whatever a world file contains: a world, or a WorldError that names the file."""

import random

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from robotont_simulator.world import World, WorldError, read_world
from robotont_testing.places import config

NUMBERS = st.integers(-5, 5) | st.floats() | st.none() | st.text(max_size=3) | st.integers().map(lambda n: n ** 9)
LISTS = st.lists(st.lists(NUMBERS, max_size=6) | NUMBERS, max_size=4) | NUMBERS
WORLDS = sorted(config("worlds").glob("*.yaml"))


def check(file, content):
    file.write_bytes(content)
    try:
        world = read_world(file)
    except WorldError as error:
        assert str(file) in str(error)
    else:
        assert isinstance(world, World)


@settings(deadline=None)
@given(content=st.dictionaries(st.sampled_from(("walls", "boxes", "start", "x", 1)), LISTS)
       .map(lambda content: yaml.safe_dump(content).encode()) | st.binary(max_size=100))
def test_any_content(tmp_path_factory, content):
    check(tmp_path_factory.getbasetemp() / "any.yaml", content)


@pytest.mark.parametrize("path", WORLDS, ids=lambda path: path.name)
@settings(deadline=None)
@given(seed=st.integers(0, 2 ** 32))
def test_shipped_worlds_with_errors(tmp_path_factory, path, seed):
    generator = random.Random(seed)
    data = bytearray(path.read_bytes())
    for _ in range(generator.randint(1, 5)):
        at = generator.randrange(len(data))
        data[at:at + generator.randint(0, 3)] = generator.choice(
            (b"", b"\n", b"- ", b"[", b"]", b"nan", b".inf", b"9" * 400, b"\xff", b"\x00", b"&a ", b"*a", b": "))
    check(tmp_path_factory.getbasetemp() / "errors.yaml", bytes(data))

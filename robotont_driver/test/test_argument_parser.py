"""`--name value` and `name:=value` mean the same, and the nearest is told to a name that is unknown."""

import pytest

from robotont_driver.parameters.argument_parser import ArgumentParser


@pytest.fixture(name="parse")
def _parse():
    parser = ArgumentParser(prog="program")
    parser.add_argument("--robot", default="thesis")
    parser.add_argument("--dry-run", action="store_true")
    parser.add_argument("port", nargs="?")
    return lambda *words: tuple(vars(parser.parse_args(words)).values())


@pytest.mark.parametrize("words, found", [
    ((), ("thesis", False, None)),
    (("--robot", "a=b", "--dry-run", "/dev/x"), ("a=b", True, "/dev/x")),
    (("robot:=--a", "dry_run:=true", "/dev/x"), ("--a", True, "/dev/x")),
    (("robot:=", "dry-run:=false", "-"), ("", False, "-")),
])
def test_both_ways(parse, words, found):
    assert parse(*words) == found


@pytest.mark.parametrize("words, complaint", [
    (("robto:=x",), "no argument --robto; did you mean --robot?"),
    (("--robto", "x"), "no argument --robto; did you mean --robot?"),
    (("--rob=x",), "no argument --rob; did you mean --robot?"),
    (("wings:=2",), "no argument --wings; see program -h"),
    (("dry_run:=maybe",), "--dry-run: ignored explicit argument 'maybe'"),
    (("a", "b"), "no argument b"),
])
def test_a_wrong_one_is_refused(parse, capsys, words, complaint):
    with pytest.raises(SystemExit) as end:
        parse(*words)
    assert end.value.code == 2
    assert complaint in capsys.readouterr().err

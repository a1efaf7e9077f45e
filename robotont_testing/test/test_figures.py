import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_testing.figures import number, percentile, reached, row, spread, text_table


@pytest.mark.parametrize("part, value", [(0.0, 1), (0.5, 50), (0.99, 99), (0.991, 100), (1.0, 100)])
def test_percentiles_by_nearest_rank(part, value):
    assert percentile(range(100, 0, -1), part) == value


@given(st.lists(st.floats(-1e6, 1e6), min_size=1), st.floats(0, 1))
def test_a_percentile_is_a_value_that_the_right_part_does_not_exceed(values, part):
    found = percentile(values, part)
    assert found in values
    assert sum(value <= found for value in values) >= part * len(values) - 1e-6


def test_no_values_have_no_percentile():
    with pytest.raises(ValueError, match="no values"):
        percentile([], 0.5)


def test_rounds_become_median_and_spread():
    line = row("latency", [3.0, 1.0, 2.0], "ms", floor=[1.0, 0.5, 4.0])
    assert (line["value"], line["min"], line["max"], line["rounds"], line["floor"]) == (2.0, 1.0, 3.0, 3, 1.0)
    assert spread(line) == "2 (1-3)"
    assert spread(row("one", 0.12345, "ms")) == "0.123"
    assert spread(row("none", None, "ms")) == spread(row("none", [], "ms")) == ""


@pytest.mark.parametrize("value, floor, bound, outcome", [
    (3.0, None, "<= 3", True), (3.1, None, "<= 3", False), (10, None, ">= 10", True), (3, None, "< 3", False),
    (0, None, "= 0", True), (1, None, "= 0", False), (1.1, 1.0, "<= 1.1 x floor", True),
    (1.2, 1.0, "<= 1.1 x floor", False), (1.2, None, "<= 1.1 x floor", None), (None, 1.0, "<= 3", None),
    (1.0, 1.0, "", None)])
def test_bounds(value, floor, bound, outcome):
    assert reached(row("x", value, "ms", floor, bound)) is outcome


@pytest.mark.parametrize("value, text", [(None, ""), (3, "3"), (60000, "60000"), (0.0, "0"), (0.12345, "0.123"),
                                         (99.97, "100"), (1234.5, "1234")])
def test_numbers(value, text):
    assert number(value) == text


def test_tables_show_floor_ratio_and_whether_the_aim_is_reached():
    rows = [row("latency, p50", [0.5, 0.6, 0.7], "ms", 0.5, "<= 1.1 x floor", "a | b", "composed")]
    line = text_table(rows).splitlines()[1]
    assert line.split("  ")[0] == "latency, p50"
    for part in ("composed", "0.6 (0.5-0.7)", "1.2", "<= 1.1 x floor: NO"):
        assert part in line

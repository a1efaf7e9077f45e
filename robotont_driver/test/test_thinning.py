import pytest

from robotont_driver.thinning import SECOND, Thinning

PERIOD = SECOND // 50


@pytest.mark.parametrize("rate", [1.0, 7.0, 20.0, 49.0])
def test_as_many_pass_as_the_rate_says_and_evenly(rate):
    thinning = Thinning(rate)
    passed = [stamp for stamp in range(0, 60 * SECOND, PERIOD) if thinning.passes(stamp)]
    assert len(passed) == pytest.approx(60 * rate, abs=1)
    assert max(after - before for before, after in zip(passed, passed[1:])) < SECOND / rate + PERIOD


@pytest.mark.parametrize("rate", [0.0, 50.0, 1000.0])
def test_none_is_held_back_that_comes_no_faster(rate):
    thinning = Thinning(rate)
    assert all(thinning.passes(stamp) for stamp in range(7, 10 * SECOND, PERIOD))


def test_a_clock_that_goes_back_silences_nothing():
    thinning = Thinning(20.0)
    assert thinning.passes(1000 * SECOND)
    assert [thinning.passes(stamp) for stamp in range(5 * SECOND, 6 * SECOND, SECOND // 20)] == [True] * 20

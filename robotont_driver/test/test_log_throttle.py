from robotont_driver.ros.diagnostics import QUIET, Refusals


def test_the_first_refusal_of_a_kind_is_logged_and_no_repetition():
    refusals = Refusals()
    logged = [refusals.refuse("number", 0.005 * number) for number in range(2000)]
    assert logged == [True] + [False] * 1999
    assert refusals.amount == 2000


def test_another_kind_is_news_and_so_is_one_after_a_quiet_time():
    refusals = Refusals()
    assert refusals.refuse("number", 0.0)
    assert refusals.refuse("fields", 2.0)
    assert not refusals.refuse("fields", 2.0 + 0.9 * QUIET)
    assert not refusals.refuse("fields", 2.0 + 1.8 * QUIET)
    assert refusals.refuse("fields", 2.0 + 2.9 * QUIET)

"""Servers of the page with a robot that only takes notes, and the page itself in a browser."""

import pytest
from page_client import open_page
from web_client import PATIENCE, TOKEN, Served

from robotont_testing.browser import one_browser


@pytest.fixture
def served():
    """A server for tests of what is done, not of when: on a busy machine, too, nothing is too late for it."""
    with Served(oldest=PATIENCE, dead_man=PATIENCE) as server:
        yield server


@pytest.fixture
def timely():
    """As it is delivered."""
    with Served() as server:
        yield server


@pytest.fixture
def guarded():
    with Served(TOKEN) as server:
        yield server


browser = pytest.fixture(scope="session")(one_browser)


@pytest.fixture
def page(browser, served):
    opened = open_page(browser, served)
    opened.wait("$('dot').dataset.level !== '1'", "the first state: no key that comes before it drives")
    yield opened
    assert opened.complaints() == []
    opened.close()

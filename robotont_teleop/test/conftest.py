"""Servers of the page with a robot that only takes notes."""

import pytest
from web_client import PATIENCE, TOKEN, Served


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

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robotont_testing.streams import Stream

CYCLE = 10


def stream_of(sent, arrived):
    """Things sent 1 s apart, and what arrives 0.25 s after the last: tags both."""
    stream = Stream()
    for time, tag in enumerate(sent):
        stream.send(time, tag)
    for tag in arrived:
        stream.arrived(len(sent) - 0.75, tag)
    return stream


def test_delays_are_from_each_sending_to_its_own_arrival():
    stream = Stream()
    stream.send(1.0, 1)
    stream.send(2.0, 2)
    stream.arrived(2.5, 1)
    stream.arrived(2.75, 2)
    assert list(stream.delays) == [1.5, 0.75]
    assert (stream.lost, stream.repeated, stream.unexpected) == (0, 0, 0)


def test_what_was_overtaken_is_lost_and_does_not_shift_the_others():
    stream = stream_of([1, 2, 3, 4], [1, 4])
    assert list(stream.delays) == [3.25, 0.25]
    assert stream.lost == stream.overtaken == 2


def test_what_is_under_way_at_the_end_is_lost():
    stream = stream_of([1, 2, 3], [1])
    assert stream.under_way == stream.lost == 2


def test_a_repetition_is_no_arrival_even_when_the_tag_will_come_again():
    sent = [index % CYCLE for index in range(2 * CYCLE)]
    stream = stream_of(sent, [0, 0, 1, 1, 2])
    assert stream.repeated == 2
    assert len(stream.delays) == 3


@pytest.mark.parametrize("arrived", [[7], [2, 1]])
def test_inventions_and_disorder_are_unexpected(arrived):
    assert stream_of([1, 2], arrived).unexpected == 1


@given(st.lists(st.booleans(), max_size=60), st.integers(0, 2))
def test_losses_are_counted_exactly_while_less_than_a_cycle_is_lost_in_a_row(kept, repetitions):
    sent = [index % CYCLE for index in range(len(kept))]
    run = 0
    arrived = []
    for tag, keep in zip(sent, kept):
        run = 0 if keep or run == CYCLE - 2 else run + 1
        if run == 0:
            arrived += [tag] * (1 + repetitions)
    stream = stream_of(sent, arrived)
    received = len(arrived) // (1 + repetitions)
    assert stream.lost == len(sent) - received
    assert len(stream.delays) == received
    assert stream.repeated == received * repetitions
    assert stream.unexpected == 0

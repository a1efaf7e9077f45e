from hypothesis import given
from hypothesis import strategies as st

from robotont_driver.protocol.carried_rounding import CarriedRounding

HOLD = 0.05  # [s]
STEP = 0.01  # two decimals

speeds = st.floats(-60.0, 60.0)
times = st.floats(0.001, HOLD)


@given(st.lists(st.tuples(st.tuples(speeds, speeds), times), min_size=1, max_size=60))
def test_no_time_integral_is_off_by_more_than_half_a_step_of_one_packet(packets):
    rounding = CarriedRounding(2, 2, HOLD)
    now, off = 100.0, [0.0, 0.0]
    for values, held in packets:
        for wheel, (value, sent) in enumerate(zip(values, rounding.round(values, now))):
            assert abs(sent - value) <= STEP + 1e-9
            off[wheel] = 0.0 if sent == 0.0 and abs(value) < 1e-9 else off[wheel] + (value - sent) * held
            assert abs(off[wheel]) <= STEP / 2 * HOLD + 1e-9
        now += held


def test_zeros_are_zeros_whatever_was_carried():
    rounding = CarriedRounding(3, 2, HOLD)
    for number in range(7):
        rounding.round([0.0049, -13.6449, 0.0], 0.05 * number)
    assert rounding.round([0.0, -0.0, 1e-12], 0.35) == [0.0, 0.0, 0.0]
    assert str(rounding.round([0.0, -0.0, -1e-12], 0.4)) == "[0.0, 0.0, 0.0]"
    assert rounding.round([0.0049, -13.6449, 0.004], 0.5) == [0.0, -13.64, 0.0]  # the stop has ended what was carried

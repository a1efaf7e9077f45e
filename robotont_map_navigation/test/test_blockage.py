from robotont_map_navigation.blockage import AWAY, PATIENCE, PAUSE, SLOW, SLOW_TURN, TRIES, Blockage

PERIOD = 0.1  # [s] of move_base's commands
HERE = 3.0, 4.0  # [m]


def zeros(blockage, seconds, start=0.0, moves=True):
    """Times at which zeros are due while commands come for so long."""
    times = [start + PERIOD * step for step in range(round(seconds / PERIOD))]
    return [now for now in times if blockage.is_zero_due(moves, now)]


def test_zeros_are_due_once_commands_have_moved_nothing_for_a_while():
    due = zeros(Blockage(), 4.0)
    assert PATIENCE <= due[0] < PATIENCE + 2 * PERIOD
    assert len(due) == 2
    assert due[1] - due[0] >= PATIENCE


def test_a_robot_that_moves_or_turns_needs_none():
    for motion in ((SLOW + 0.01, 0.0), (0.0, SLOW_TURN + 0.01), (0.0, -SLOW_TURN - 0.01)):
        blockage = Blockage()
        for second in range(20):
            assert zeros(blockage, 1.0, start=second) == []
            blockage.measure(HERE, *motion)


def test_noise_is_no_motion():
    blockage = Blockage()
    for second in range(4):
        due = zeros(blockage, 1.0, start=second)
        blockage.measure(HERE, 0.005, 0.024)
    assert due or blockage.tries


def test_zeros_of_move_base_itself_and_pauses_begin_anew():
    blockage = Blockage()
    assert zeros(blockage, 1.4) == []
    assert zeros(blockage, 0.1, start=1.4, moves=False) == []
    assert zeros(blockage, 1.4, start=1.5) == []
    assert zeros(blockage, 1.4, start=3.0 + PAUSE) == []


def test_it_gives_up_where_nothing_helps_until_the_robot_has_got_away():
    blockage = Blockage()
    blockage.measure(HERE, 0.0, 0.0)
    assert len(zeros(blockage, 60.0)) == TRIES
    assert zeros(blockage, 0.1, start=60.0, moves=False) == []
    assert zeros(blockage, 10.0, start=61.0) == []
    blockage.measure((3.0 + 0.9 * AWAY, 4.0), 0.1, 0.0)
    assert zeros(blockage, 10.0, start=71.0) == []
    blockage.measure((3.0 + 1.1 * AWAY, 4.0), 0.1, 0.0)
    assert len(zeros(blockage, 2.0, start=81.0)) == 1


def test_a_robot_that_only_jerks_as_with_a_broken_encoder_is_left_alone_after_a_few_tries():
    blockage = Blockage()
    sent = 0
    for jerk in range(20):
        blockage.measure((3.0 + 0.01 * jerk, 4.0), 0.3, 1.0)
        sent += len(zeros(blockage, 2.0, start=2.0 * jerk))
    assert sent == TRIES

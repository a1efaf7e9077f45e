"""The motor that is assumed where the wheel file names none: Pololu 37D, 12 V."""

NO_LOAD_SPEED = 156.25  # [1/s] turns of the motor's own shaft without load at 12 V: 500 rpm behind a gearbox of 18.75
FULL_BATTERY = 1.4      # 4-cell LiPo, 16.8 V, over 12 V
RESERVE = 1.07          # for motors that are faster than their data sheet


def counts_in_reach(wheels):
    """Largest number of encoder edges that a motor makes in one PID period, on a full battery, with a reserve."""
    return round(NO_LOAD_SPEED * FULL_BATTERY * RESERVE * wheels.edges_per_motor_turn / wheels.pid_frequency)

"""How often packets have to come so that the driver does not count as dead."""

PUBLISH_RATE = 20.0   # [Hz] default of driver_node ~publish_rate
WRITE_TIMEOUT = 0.5   # [s] default of serial_com_node ~write_timeout
PACKETS_IN_TIME = 2   # that driver_node repeats within serial_com_node's time-out: one may be late


def check_repetition(publish_rate, write_timeout):
    """List of conflicts between driver_node's rate [Hz] and serial_com_node's time-out [s]."""
    if write_timeout * publish_rate >= PACKETS_IN_TIME:
        return []
    return [f"driver_node/publish_rate and serial_com_node/write_timeout: found a packet every {1 / publish_rate:g} s "
            f"and a stop after {write_timeout:g} s without one: the robot would stutter; allowed: a publish_rate >= "
            f"{PACKETS_IN_TIME / write_timeout:g} [Hz], or a write_timeout >= {PACKETS_IN_TIME / publish_rate:g} [s]"]

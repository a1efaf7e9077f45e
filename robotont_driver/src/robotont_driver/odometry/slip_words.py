"""What is wrong with the wheels, in words: of what the searches for slip have found."""


def compared_by(gyro, detector, watch):
    """The comparisons that the search is based on; each is None where there is none."""
    if gyro:
        return "the gyro, and " + ("each other, " if detector else "") + "command and measurement"
    if detector:
        return "each other, and command and measurement"
    return "command and measurement only" if watch else "nothing (packets of speeds)"


def fault_of_wheels(slipping, suspects, lagging, amount, gyro):
    """The gravest fault; empty when there is none. Tuples of wheels: excluded, disagreeing with the gyro, standing."""
    if slipping:
        return (f"{list_wheels(slipping)} {_verb(slipping, 'disagrees', 'disagree')} with the others and "
                f"{_verb(slipping, 'is', 'are')} excluded from the odometry: look for a slipping or blocked wheel, a "
                "loose coupling, an unplugged encoder")
    if suspects:
        return disagreement(suspects, amount)
    if lagging:
        hint = "" if amount > 3 or gyro else ("; with 3 wheels only command and measurement can be compared, and the "
                                              "odometry goes on with all")
        return (f"{list_wheels(lagging)} {_verb(lagging, 'does', 'do')} not turn as commanded: look for a blocked "
                f"wheel, a loose motor or encoder cable, an empty battery{hint}")
    return ""


def disagreement(suspects, amount):
    """The gyro measures another turn than the wheels: one of the `suspects` slips, or, of all `amount`, the robot."""
    if len(suspects) == amount:
        return ("the gyro measures another turn than the wheels: the robot is pushed, lifted or carried, or a wheel "
                "slips or is blocked")
    names = " or ".join(f"wheel {wheel}" for wheel in suspects)
    return f"{names} slips: the gyro measures another turn than the wheels"


def list_wheels(wheels):
    """Wheels by index, as text; empty for none."""
    *first, last = map(str, wheels) if wheels else [""]
    return "wheels " + ", ".join(first) + " and " + last if first else last and "wheel " + last


def _verb(wheels, one, several):
    return one if len(wheels) == 1 else several

"""What is wrong with the wheels, in words: of what a `SlipSearch` has found."""


def values_of(search):
    """Values for the diagnostics, by name."""
    values = {
        "wheels excluded": list_wheels(search.slipping) or "none",
        "wheels found so far": search.alarms,
        "noise of the wheels, learnt": f"{search.noise.ratio:.1f} x wheel_noise",
    }
    for wheel, share in enumerate(search.followed or ()):
        values[f"wheel {wheel}: part of the commanded path"] = "at rest" if share is None else f"{share:.0%}"
    return values


def fault_of_wheels(search):
    """The gravest fault; empty when there is none."""
    if search.slipping:
        return (f"{list_wheels(search.slipping)} disagrees with the others and is excluded from the odometry: look for "
                "a slipping or blocked wheel, a loose coupling, an unplugged encoder")
    if search.alike:
        wheels = [wheel for wheel in search.alike if wheel < search.wheels]
        moved = "the robot is pushed, lifted or carried" if len(wheels) < len(search.alike) else ""
        slips = f"{'one of ' if len(wheels) > 1 else ''}{list_wheels(wheels)} slips or is blocked" if wheels else ""
        return " or ".join(filter(None, (moved, slips))) + ": the odometry goes on with all, its covariance grows"
    if search.lagging:
        does = "does" if len(search.lagging) == 1 else "do"
        return (f"{list_wheels(search.lagging)} {does} not turn as commanded: look for a blocked wheel, a loose motor "
                "or encoder cable, an empty battery")
    return ""


def list_wheels(wheels):
    """Wheels by index, as text; empty for none."""
    *first, last = map(str, wheels) if wheels else [""]
    return "wheels " + ", ".join(first) + " and " + last if first else last and "wheel " + last

"""What a free wheel's answers to steps of effort tell about its motor: arrays in, numbers out.

Model: a DC motor with Coulomb friction, seen from rest. With effort u the speed v [edges per period] obeys
tau dv/dt = (|u| - friction) / gain - v, so a step of u from the moment t0 at which it sets off makes

    v(t) = speed * (1 - exp(-(t - t0) / tau)),      speed = (|u| - friction) / gain

Its integral, the edges counted so far, is linear in (t, 1, exp(-t / tau)). tau is common to the steps of one direction.
Standard errors are the jackknife's over the steps (Efron and Stein 1981), so they hold what differs between them:
cogging, uneven edges, the gear's play. What all steps have alike, such as inductance, shifts tau: UNSEEN.
"""

from typing import NamedTuple

import numpy as np

LEAST_SPEED = 5.0   # [edges/period] slower steps creep on what friction is at rest
LEAST_STEPS = 4
UNSEEN = 0.04       # [periods] 0.8 ms
LEAST_PERIODS = 8   # of a step that its speed's bound cut short
SHORTEST, LONGEST = 0.2, 40.0  # [periods] time constants that are looked for
# A fit is refused beyond these.
MOST_RESIDUAL = 0.7, 0.03  # [edges/period] and parts of the greatest speed; whole edges alone make 0.4
MOST_BEND = 0.02    # parts of the greatest speed, rms, by which the steps' speeds leave a straight line
MOST_ERROR = {"gain": 0.04, "tau": 0.12}  # standard error as part of the number
# Two wheels, or directions, differ.
DIFFERENT = 0.15    # parts of the mean
FRICTION_APART = 80  # [effort]
# What is proposed, in [1/16 period].
ROTOR_LEAD = 38  # of LEAD and TURN_LEAD by the rule of mass is the motor's own
LAG = 12         # between counts and effort; steps of motors of 40 to 100 ms are best with it


class DirectionFit(NamedTuple):
    """One wheel in one direction, in [effort] and [periods]; each number is (value, standard error).

    turns: least effort of the steps with which it turned. residual: rms of the counts against the model
    [edges/period]. bend: MOST_BEND's. fastest: greatest speed of the model [edges/period]. fault: why the numbers do
    not hold, or empty.
    """

    turns: float
    friction: tuple
    gain: tuple  # effort per edge/period
    tau: tuple
    residual: float
    bend: float
    fastest: float
    fault: str

    def speed(self, effort):
        """Speed [edges/period] that an effort gives in the end."""
        return max(0.0, effort - self.friction[0]) / self.gain[0]


def fit_direction(efforts, steps):
    """`DirectionFit` of efforts (n,), all positive, and steps: n arrays of counts per driven period, ahead positive.

    Raises ValueError, with why, where too few steps turned the wheel.
    """
    turned = [effort for effort, counts in zip(efforts, steps) if np.sum(counts) > len(counts)]
    kept = [(effort, np.asarray(counts, float)) for effort, counts in zip(efforts, steps)
            if len(counts) >= LEAST_PERIODS and np.mean(counts[len(counts) // 2:]) >= LEAST_SPEED]
    if len(kept) < LEAST_STEPS:
        cut = sum(len(counts) < max(map(len, steps)) for counts in steps)
        raise ValueError(f"it turns from {min(turned, default=np.inf):.0f} on; only {len(kept)} of {len(steps)} steps "
                         f"turned it at {LEAST_SPEED:g} edges a period or more, {LEAST_STEPS} are needed"
                         + (f"; {cut} were ended by the bound on its speed: a driver that coasts?" if cut else ""))
    pushes = np.array([effort for effort, _ in kept])
    heads = [_head(counts) for _, counts in kept]
    (numbers, *without), speeds, squares = _solve(pushes, heads)
    errors = np.sqrt((len(kept) - 1) * np.var(without, axis=0))
    errors[2] = np.hypot(errors[2], UNSEEN)
    friction, gain, tau = zip(numbers, errors)
    residual = float(np.sqrt(squares / sum(len(counts) - 1 for _, counts in heads)))
    bend = float(np.sqrt(np.mean((speeds - (pushes - friction[0]) / gain[0]) ** 2)) / speeds.max())
    found = DirectionFit(min(turned), friction, gain, tau, residual, bend, float(speeds.max()), "")
    return found._replace(fault=_fault(found))


def _head(counts):
    """(time (m,) [periods], edges (m,) so far) from the first period whose end finds the wheel under way."""
    edges = np.cumsum(counts)
    first = int(np.argmax(edges >= 2))
    return np.arange(first, len(edges), dtype=float) - first, edges[first:]


def _solve(pushes, heads):
    """Least squares of all steps, and without each: (n + 1, 3) of friction, gain, tau.

    Of all steps the speeds, too, and the sum of the squared residuals of the counts.
    """
    grid = np.log(np.geomspace(SHORTEST, LONGEST, 25))
    costs = _costs(heads, grid)
    best = grid[np.argmin(costs.sum(axis=0))]
    grid = best + np.linspace(grid[0] - grid[1], grid[1] - grid[0], 41)
    costs = _costs(heads, grid)
    found = []
    for out in range(-1, len(heads)):
        rest = [at for at in range(len(heads)) if at != out]
        tau = _least(grid, costs[rest].sum(axis=0))
        steps = [_step(*heads[at], tau) for at in rest]
        slope, offset = np.polyfit(pushes[rest], [speed for speed, _, _ in steps], 1)
        found.append((-offset / slope, 1 / slope, tau))
        if out < 0:
            speeds, squares = np.array([step[0] for step in steps]), sum(step[2] for step in steps)
    return np.array(found), speeds, squares


def _costs(heads, grid):
    """Sums of squares (steps, time constants) for the logarithms of time constants."""
    return np.array([[_step(*head, tau)[1] for tau in np.exp(grid)] for head in heads])


def _least(grid, costs):
    """The time constant of the least cost, by the parabola through it and its neighbours."""
    at = min(max(int(np.argmin(costs)), 1), len(grid) - 2)
    before, here, after = costs[at - 1:at + 2]
    bend = before - 2 * here + after
    shift = np.clip((before - after) / (2 * bend), -1, 1) if bend > 0 else 0.0
    return float(np.exp(grid[at] + shift * (grid[1] - grid[0])))


def _step(times, edges, tau):
    """(speed, sum of the squared residuals of the edges so far, the same of the counts) of one step."""
    base = np.stack([times, np.ones_like(times), np.exp(-times / tau)], axis=1)
    solution = np.linalg.lstsq(base, edges, rcond=None)[0]
    off = edges - base @ solution
    return solution[0], off @ off, np.sum(np.diff(off) ** 2)


def _fault(fit):
    """Why a fit's numbers do not hold; empty when they do."""
    most = MOST_RESIDUAL[0] + MOST_RESIDUAL[1] * fit.fastest
    faults = (
        (fit.residual > most, f"its counts leave the model by {fit.residual:.1f} edges a period, {most:.1f} are "
                              "allowed: an encoder that loses edges, lost packets, or a wheel that touches something"),
        (fit.bend > MOST_BEND, "its speed does not grow evenly with the effort: a driver that coasts, a battery that "
                               "gives way, or a wheel that touches something"),
        (fit.tau[0] >= 0.9 * LONGEST or fit.tau[1] > MOST_ERROR["tau"] * fit.tau[0], "its time constant is uncertain: "
         "a step is too short for it (TEST_TIME), or no two are alike"),
        (fit.gain[1] > MOST_ERROR["gain"] * fit.gain[0], "its speed by effort is uncertain: no two steps are alike"),
        (fit.friction[0] < -2 * fit.friction[1] - 20, "it turns faster than its effort allows: something drives it"),
    )
    return next((words for found, words in faults if found), "")


def compare(fits):
    """Lines about wheels, or directions of one, that differ so that a fault is likely; fits: [(forward, backward)]."""
    lines = []
    for wheel, (ahead, back) in enumerate(fits):
        top = ahead.speed(_common(fits)), back.speed(_common(fits))
        if abs(top[0] - top[1]) > DIFFERENT * max(top):
            lines.append(f"wheel {wheel} turns {100 * (1 - min(top) / max(top)):.0f} % slower "
                         f"{'backward' if top[1] < top[0] else 'forward'}: a bad contact of one direction, or friction")
    means = np.array([[np.mean([fit.friction[0] for fit in pair]), np.mean([fit.gain[0] for fit in pair]),
                       np.mean([fit.tau[0] for fit in pair]), np.mean([fit.speed(_common(fits)) for fit in pair])]
                      for pair in fits])
    for wheel in range(len(fits)):
        friction, gain, tau, speed = means[wheel]
        usual = np.median(means, axis=0)
        apart = 100 * (np.array([gain, tau, speed]) / usual[1:] - 1)  # [%]
        reasons = [words for found, words in (
            (friction - usual[0] > FRICTION_APART, "more friction, or less current (contact, driver)"),
            (apart[0] > 100 * DIFFERENT, "fewer edges for its effort: an encoder that loses some, another gear, or "
                                         "less voltage"),
            (apart[1] > 100 * DIFFERENT, "a heavier wheel, or less current (contact, driver)")) if found]
        if reasons or abs(apart[2]) > 100 * DIFFERENT:
            lines.append(f"wheel {wheel} differs: speed {apart[2]:+.0f} %, time constant {apart[1]:+.0f} %, friction "
                         f"{friction - usual[0]:+.0f}: " + ("; ".join(reasons) or "see its numbers"))
    return lines


def _common(fits):
    """The greatest effort of all steps, at which wheels are compared."""
    return max(fit.friction[0] + fit.fastest * fit.gain[0] for pair in fits for fit in pair)


def propose(fits, volts, present):
    """{name: number} for the wiring profile, as of 12 V, from fits [(forward, backward)] that hold.

    volts: of the battery, as BATTERY says or as measured. present: {name: number} of the profile's LEAD and TURN_LEAD,
    of which the motor's own part is exchanged (docs/firmware.md); may lack them.
    """
    both = [fit for pair in fits for fit in pair]
    friction, gain, tau = np.mean([(fit.friction[0], fit.gain[0], fit.tau[0]) for fit in both], axis=0).tolist()
    own = round(16 * tau)
    found = {"STATIC": round(max(0.0, friction) * volts / 12), "SPEED_GAIN": round(256 * gain * volts / 12)}
    found.update({name: present[name] - ROTOR_LEAD + own for name in ("LEAD", "TURN_LEAD") if name in present})
    return {**found, "FREE_LEAD": own + LAG}

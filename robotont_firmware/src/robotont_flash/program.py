"""Put the firmware on a NUCLEO-L476RG: listen, show the wiring, ask, compile, identify, copy, reset, test itself.

A Robotont as it was built must not get it: the driver supports its official firmware, since March 2020.
"""

import math
import re
import runpy
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

from robotont_driver.kinematics.wheel_params import WHEEL_MASS
from robotont_driver.link.serial_port import explain
from robotont_driver.parameters.argument_parser import ArgumentParser
from robotont_driver.robots.robot_folder import read_robot
from robotont_firmware import __version__ as new
from robotont_firmware import check_pin_profile
from robotont_flash import board_check, chip_pins, copying
from robotont_flash.board_check import FlashError

PACKAGE = Path(check_pin_profile.__file__).resolve().parent
NEAR = 0.02  # part by which a profile's number may differ from the robot's ...
CALIBRATED = {"RADIUS": 0.07, "DISTANCE": 0.07}  # ... that a calibration moves, the mean radius by 6 % at most
SAME = ("WHEELS", "RATE", "EDGES", "EVEN")  # do not differ at all
EVEN = 0.1  # by which the sines of the angles between wheels may differ
HOLLOW = 0.34  # moment of inertia of a wheel, in its mass times its radius squared
FAR = 5  # times as much or as little is a mistake; a body much wider than its wheels' circle has 4
USUAL = 0.75  # inertia in mass times the wheels' distance squared: the thesis' robot has 0.77, four_wheels 0.73

# What is on the board, as the last line of every message about a failure.
UNTOUCHED = "Nothing was written: the board has what it had."
STOPPED = "The board has the files that it had; a firmware that ran was stopped. RESET starts it again."
RESTARTED = "The board has the files that it had. It was reset: a firmware that ran starts again."
EXCHANGING = ("The board has the old firmware, or the new one, or none that runs (then nothing drives its motors), "
              "and no mixture. Run this again, with --profile.")  # fmt: skip
NEW = "The new firmware is on the board, whole."


def read_numbers(path):
    """Return {name of a number: its value} of a file of settings."""
    return {name: value for name, value in runpy.run_path(str(path)).items() if name.isupper()}


def choose_profile(package, name):
    """Return (all numbers, those that the profile brings) by a profile's name.

    FlashError unless there is one that can work, with its file's name, the firmware's names and all that it needs.
    """
    known = {path.stem.partition("pin_profile_")[2] or "ours": path for path in sorted(package.glob("pin_profile*.py"))}
    if name not in known:
        about = {profile: re.search('^DESCRIPTION = "(.*)"', path.read_text(encoding="utf-8"), flags=re.MULTILINE)
                 for profile, path in known.items()}
        raise FlashError("\n".join(["Which robot is it? Choose with --profile:", *(
            f"  {profile:12}{found[1] if found else ''}" for profile, found in about.items())]))
    try:
        config, ours, wiring = map(read_numbers, (package / "config.py", package / "pin_profile.py", known[name]))
        if wiring.get("PROFILE") != name:
            raise ValueError(f"PROFILE: found {wiring.get('PROFILE')!r}, allowed: {name!r}, its file's")
        odd = {*wiring} - {*config} | {*ours} - {*wiring}
        if odd:
            raise ValueError(f"{min(odd)} is missing, or not known; allowed: the names of config.py, and all of "
                             "pin_profile.py")  # fmt: skip
        config.update(wiring)
        check_pin_profile.check(SimpleNamespace(**config))
        chip_pins.check(config)
        if config["BAUDRATE"] != board_check.BAUDRATE:
            raise ValueError(f"BAUDRATE: found {config['BAUDRATE']}, allowed: {board_check.BAUDRATE}, "
                             "with which flash and wheels speak")
        if config["CONTINUOUS_TORQUE"] > config["MAX_TORQUE"]:
            raise ValueError(f"CONTINUOUS_TORQUE: found {config['CONTINUOUS_TORQUE']}, allowed: up to MAX_TORQUE, "
                             f"{config['MAX_TORQUE']}")  # fmt: skip
    except ValueError as error:
        raise FlashError(f"profile {name}: {error}") from error
    except Exception as error:  # whatever stands in a file that somebody has written
        raise FlashError(f"profile {name}: cannot be read: {type(error).__name__}: {error}") from error
    return config, wiring


def numbers_of(wheels):
    """The numbers of config.py that `Wheels` tell, by their names."""
    radius, distance = sum(wheels.radii) / wheels.amount, sum(map(abs, wheels.levers)) / wheels.amount
    motor, turns = wheels.motor, sum(wheels.levers)
    # how the wheels follow each other in the direction in which they turn the robot
    steps = [math.sin(after - before) * ((turns > 0) - (turns < 0))
             for before, after in zip(wheels.directions, wheels.directions[1:] + wheels.directions[:1])]
    turned = motor.rotor_inertia + HOLLOW * WHEEL_MASS * (radius / wheels.gear) ** 2
    return {"WHEELS": wheels.amount, "RATE": round(wheels.pid_frequency), "EDGES": wheels.edges_per_motor_turn,
            "GEAR": round(100 * wheels.gear), "RADIUS": round(1e6 * radius), "DISTANCE": round(1e6 * distance),
            "EVEN": int(max(steps) - min(steps) <= EVEN and sum(steps) > 0.0),
            "NO_LOAD_SPEED": round(10 * motor.no_load_speed), "MASS": round(1000 * wheels.mass),
            "STALL_TORQUE": round(1e6 * motor.stall_torque),
            "TIME_CONSTANT": round(1e3 * turned * motor.no_load_speed / motor.stall_torque)}


def check(profile, robot):
    """Check a profile without a board, beside a robot (name or folder) where one is named.

    FlashError: it is wrong. OSError, ValueError: there is no such robot.
    """
    config, wiring = choose_profile(PACKAGE, profile)
    print(describe(wiring))
    wanted = numbers_of(read_robot(robot).wheels) if robot else {}
    time_constant = wanted.pop("TIME_CONSTANT", None)
    different = [f"{number}: {config[number]} in the profile, {value} by the robot" for number, value in wanted.items()
                 if abs(config[number] - value) > value * (0 if number in SAME else CALIBRATED.get(number, NEAR))]
    if different:
        raise FlashError("\n".join([f"profile {profile} is another robot's:", *different]))
    # of which a scale or a film may know more
    usual = {"INERTIA": USUAL * config["MASS"] * (config["DISTANCE"] / 1e4) ** 2, "TIME_CONSTANT": time_constant}
    for number, value in usual.items():
        if value:
            found = f"{number}: {config[number]} in the profile, by the other numbers about {value:.0f}"
            print(found)
            if not 1 / FAR < config[number] / value < FAR:
                raise FlashError(f"profile {profile}: {found}, allowed: from a {FAR}th of that to {FAR} times as much")
    print(f"Profile {profile} can work" + (f", and has the numbers of {robot}." if robot else "."))


def describe(wiring):
    """Return a profile's wiring as a table for people."""
    lines = ["Wiring profile {}: {}".format(wiring["PROFILE"], wiring["DESCRIPTION"]), "",
             f"  {'motor':7}{'encoder A, B':15}{'PWM':7}{'forward, backward':20}fault"]
    for motor, (a, b, *_) in enumerate(wiring["ENCODERS"]):
        encoder, directions = f"{a}, {b}", ", ".join(wiring["DIRECTIONS"][motor])
        fault = wiring["FAULTS"][motor] if wiring["FAULTS"] else "none"
        lines.append(f"  {motor:<7}{encoder:15}{wiring['PWM'][motor][0]:7}{directions:20}{fault}")
    lines += ["", "  PWM {:g} kHz, battery {:g} V. A board that is wired otherwise may run away.".format(
        wiring["PWM_FREQUENCY"] / 1e3, wiring["BATTERY"] / 1e3)]  # fmt: skip
    return "\n".join(lines)


def confirm(wiring, on_board, yes):
    """Show the wiring and ask; FlashError unless the answer is the profile's name."""
    name = wiring["PROFILE"]
    print(describe(wiring))
    if on_board and on_board != name:
        print(f"  ATTENTION: the board has the profile {on_board} now.")
    if yes:
        return
    print(f"Is the board wired like that? Type {name} to go on: ", end="", flush=True)
    if sys.stdin.readline().strip() != name:
        raise FlashError("The answer was another one. (Without a terminal: --yes)")


def flash(port, profile, yes):
    """Flash; yield what the board has from then on. FlashError states what went wrong."""
    port = board_check.find_port(port)
    print(f"Listening on {port} ...")
    try:
        there = board_check.check_board(port)
        _, wiring = choose_profile(PACKAGE, profile or (there and there.profile))
        confirm(wiring, there and there.profile, yes)
        with tempfile.TemporaryDirectory() as folder:
            files = copying.stage(PACKAGE, wiring, folder)
            print(f"{len(files)} files compile.")
            yield STOPPED
            board_check.free_repl(port)
            other = copying.identify(port, files)
            if other:
                copying.mpremote(port, "reset")
                yield RESTARTED
                raise FlashError(other)
            if there:
                print(f"The board has firmware {there.version}; it gets {new} now.")
            yield EXCHANGING
            copying.copy(port, files)
        yield NEW
        print(f"Copied to {port}. The board restarts.")
        copying.mpremote(port, "reset")
        print(board_check.self_test(port, new, wiring["PROFILE"]))
    except OSError as error:
        raise FlashError(explain(port, error)) from error


def main():
    """Flash; return the exit status."""
    parser = ArgumentParser(prog="./robotont flash", description=__doc__)
    parser.add_argument("--port", help="serial port of the board (default: the only one of the ST-Link's USB vendor)")
    parser.add_argument("--profile", help="how the board is wired; without it the one that is on the board, as this "
                        "clone has it")
    parser.add_argument("--yes", action="store_true", help="do not ask")
    parser.add_argument("--check", action="store_true", help="only say whether the profile can work: needs no board")
    parser.add_argument("--robot", metavar="NAME or FOLDER", help="with --check: whether it has its numbers, too")
    options = parser.parse_args()
    on_the_board = ""
    try:
        if options.check:
            check(options.profile, options.robot)
            return 0
        on_the_board = UNTOUCHED
        for on_the_board in flash(options.port, options.profile, options.yes):  # noqa: B007 (and ends with it)
            pass
    except (FlashError, OSError, ValueError) as error:
        print(error, *filter(None, [on_the_board]), sep="\n", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("", "Interrupted.", on_the_board, sep="\n", file=sys.stderr)
        return 130
    return 0

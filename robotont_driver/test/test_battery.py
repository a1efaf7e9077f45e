"""How full a battery is."""

import math

import pytest

from robotont_driver.robots.battery import Battery, read_pack
from robotont_driver.robots.robot_folder import read_robot

PACK = {"curve": [[13.0, 0.0], [14.0, 0.1], [16.0, 1.0]], "resistance": 0.1}


@pytest.mark.parametrize(("voltage", "current", "charge"), [
    (15.0, 0.0, 0.55), (14.8, 2.0, 0.55), (15.0, math.nan, 0.55), (12.0, 0.0, 0.0), (17.0, 0.0, 1.0),
    (7.0, 0.0, math.nan), (math.nan, 0.0, math.nan)])
def test_the_charge_is_that_of_the_voltage_at_rest(voltage, current, charge):
    battery = Battery(read_pack(PACK))
    battery.hear(voltage, current, 0.0)
    assert battery.charge == pytest.approx(charge, nan_ok=True)


def test_motors_at_work_do_not_make_it_low_what_lasts_does():
    battery = Battery(read_pack(PACK))
    said = []
    for second in range(200):
        battery.hear(14.2 if second % 20 == 0 and second < 100 else 13.9 if second < 150 else 12.0, math.nan, second)
        said.append(battery.complaint)
    assert set(said[:110]) == {(False, "")}
    assert said[149] == (False, "the battery is low, 9 %: charge it")
    assert said[199] == (True, "the battery is empty, 0 %: charge it")
    battery.hear(14.2, math.nan, 200)
    assert battery.complaint == (False, "")


@pytest.mark.parametrize("given", [
    {}, [], "4S", {"curve": PACK["curve"]}, {**PACK, "cells": 4}, {**PACK, "resistance": math.nan},
    {**PACK, "curve": [[14.0, 0.0], [13.0, 1.0]]}, {**PACK, "curve": [[13.0, 0.5], [14.0, 0.4]]},
    {**PACK, "curve": [[13.0, 0.0], [14.0, 100]]}, {**PACK, "curve": [[14.0, 0.0]]},
    {**PACK, "curve": [[13.0, 0.0], [math.inf, 1.0]]}])
def test_a_wrong_pack_is_refused(given):
    with pytest.raises(ValueError, match="battery: found"):
        read_pack(given)


@pytest.mark.parametrize("name", ["robotont2", "robotont3"])
def test_the_shipped_packs_are_sound(name):
    battery = Battery(read_pack(read_robot(name).parameters["battery"]))
    battery.hear(16.8, 0.0, 0.0)
    assert battery.charge == 1.0
    assert read_pack(None) is None

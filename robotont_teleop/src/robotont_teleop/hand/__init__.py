"""Driving by hand: what keys, a gamepad and every other hand have in common.

In go keys of a terminal, a gamepad's events, and what a person asks for. Out come commands on `cmd_vel/hand`, presses
of the emergency stop and requests, none of which is carried out late.
"""

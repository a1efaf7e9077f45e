"""Twists with their age and presses of the emergency stop in; the twist that may be carried out now out."""

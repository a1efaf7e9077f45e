"""From commands to the motion that may be carried out.

In go twists with their age and presses of the emergency stop. Out comes the twist to carry out now: limited, or zero
when commands end, are refused, too old, or a stop is pressed.
"""

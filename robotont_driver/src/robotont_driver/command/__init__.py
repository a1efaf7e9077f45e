"""From commands to the motion that may be carried out.

In go twists with their age and presses of the emergency stop. Out comes the twist to carry out now: limited, or zero
when commands end or are refused, or a stop is pressed. A command that is too old is dropped.
"""

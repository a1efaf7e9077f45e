"""Time without a clock of its own: callers hand their readings in.

In go arrival times. Out come the times at which the board made its packets, and whether this process was stopped or
starved.
"""

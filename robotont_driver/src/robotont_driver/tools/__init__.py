"""For the terminal: which robot is at a port; what each program imports first.

In goes what a board sends. Out come words.
"""

"""For the terminal: which robot is at a port, what is wrong with one; what each program imports first.

In go what a board sends, and a robot's folder. Out come words.
"""

"""What passes over the line: packets of speeds and of counts, in the protocol of each kind of board.

In go bytes from the board and wheel speeds for it. Out come counts without gaps, the board's state, and bytes.
"""

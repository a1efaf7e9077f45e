"""What passes over the line: packets of speeds and of counts, in the protocol of each kind of board.

In go bytes from the board and wheel speeds for it. Out come packets without gaps, the board's state, and bytes.
connection: one open port, and which protocol. protocol (with plain), checked, official_boards: the protocols.
"""

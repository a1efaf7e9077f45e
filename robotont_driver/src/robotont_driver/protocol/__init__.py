"""What passes over the line: packets of speeds and of counts, in the protocol of each kind of board.

In go bytes from the board and wheel speeds for it. Out come packets without gaps, the board's state, and bytes.
connection: one open port. handshake: which protocol. plain, checked, robotont2, robotont3: the protocols.
"""

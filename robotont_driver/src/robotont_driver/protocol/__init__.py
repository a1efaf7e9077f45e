"""What passes over the line: packets of speeds and of counts, in the protocol of each kind of board.

In go bytes from the board and wheel speeds for it. Out come packets, the board's state, and bytes. Lost ones are made
good where the board tells them. connection: one open port, and which protocol: plain, checked, or of official_boards.
"""

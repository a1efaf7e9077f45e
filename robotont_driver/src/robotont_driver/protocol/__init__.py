"""Bytes of the board and wheel speeds for it in; packets, lost ones included, the board's state and bytes out."""

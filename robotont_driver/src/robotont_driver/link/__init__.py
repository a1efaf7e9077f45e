"""The serial port: opens it, reads, writes, and connects again.

In go packets to send, and lines for the lights. Out come packets and the state of the port. A packet that is too old is
dropped here.
"""

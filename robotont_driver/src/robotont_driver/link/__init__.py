"""The serial port: opens it, reads, writes, and connects again.

In go lines to write. Out come lines read and the state of the connection. A line that is too old is dropped here.
"""

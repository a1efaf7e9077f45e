"""The serial port: packets to send and lines for the lights in; the board's bytes and the port's state out."""

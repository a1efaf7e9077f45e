"""Commands for the terminal: find out which robot is at a port, and which wheel counts which way."""

"""Which of several senders of commands drives, and how fast a hand may drive towards what the sensors show.

In go the commands of all inputs, scans and ranges. Out comes one `cmd_vel`, and who drives.
"""

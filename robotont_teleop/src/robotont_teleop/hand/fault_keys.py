"""One key for each fault that diagnostics can tell, by which pages translate it; free of ROS.

A report without a key keeps its own words: a wrong sentence would be worse than an English one.
"""

import re

FAULTS = tuple((key, re.compile(task + "$"), re.compile(words)) for key, task, words in (  # the first that fits
    ("port_missing", "link", r"no such file|not there|not opened yet|device is gone|unplugged"),
    ("port_taken", "link", r"busy|taken|in use|another program|belongs to"),
    ("port_forbidden", "link", r"[Pp]ermission|may not open|dialout"),
    ("board_silent", "link|wheel feedback", r"(?<!were )no packets?\b|no data from the board"),
    ("board_unknown", "link|board", r"none is a packet|another (board|robot)|does not fit|March 2020|"
                                   r"lines come, but|tells a protocol|"
                                   r"the board (drives|controls|counts)"),
    ("wrong_rate", "link|stamps", r"pidControlFrequency"),
    ("line_noisy", "link", r"lines (dropped|(are )?lost)|packets lost"),
    ("program_fault", ".*", r"please report it|a fault of this program"),
    ("board_fault", "board", r"motor|watchdog|encoder"),
    ("battery_low", "board|battery", r"battery"),
    ("wheel_slips", "wheel feedback", r"^wheel .*slip"),  # those that begin otherwise: or the robot is pushed
    ("wheel_blocked", "wheel feedback", r"stands|does not turn"),
    ("other_publisher", "who drives", r"also on cmd_vel"),
    ("other_sender", "who drives", r"ignored: "),
    ("barred", "who drives|command stream", r"must stop once"),
    ("no_driver", "who drives", r"no driver_node"),
    ("refused", "who drives|command stream", r"refused|NaN|not finite"),
    ("in_the_way", "guard", r"in the way"),
    ("guard_blind", "guard", r"\w cannot be used"),
    ("page_let_go", "web page", r"let go"),
    ("pad_gone", "gamepad", r"out of reach"),
    ("pad_missing", "gamepad", r"no gamepad"),
    ("no_scan", "localization", r"no scan"),
    ("no_map", "localization", r"no map"),
    ("lost", "localization", r"pose"),
    ("held", "motion", r"holds the robot"),
    ("fleet_silent", "fleet", r"no answer from"),
))


def fault_key(task, words):
    """Key of what a task ("node: name") says in its words, or ""."""
    subject = task.rpartition(": ")[2]
    return next((key for key, pattern, sign in FAULTS if pattern.match(subject) and sign.search(words)), "")

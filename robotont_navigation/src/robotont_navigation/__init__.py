"""Goals on a map: goto, an action client of move_base."""

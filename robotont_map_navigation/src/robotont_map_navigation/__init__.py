"""Goals on a map: goto, an action client of move_base; and localization_monitor, which watches whether the map fits."""

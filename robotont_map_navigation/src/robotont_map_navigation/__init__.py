"""Goals on a map: goto, a client of move_base; what watches whether the map fits, and what makes room at walls."""

"""Whether the map shows that a goal cannot be reached; without ROS."""


def refusal(floor_map, goal, start, radius):
    """Why a round robot of `radius` [m] cannot be sent to `goal`, (x, y) [m] on the map; None when it can.

    start: (x, y) [m] of the robot; None when it is not known.
    """
    place = f"({goal[0]:.2f}, {goal[1]:.2f})"
    if goal not in floor_map:
        length, width = floor_map.size
        return f"{place} is off the map, which is {length:.1f} m x {width:.1f} m large"
    if floor_map.is_occupied(goal):
        return f"{place} is in a wall of the map"
    clearance = floor_map.clearance(goal, radius)
    if clearance < radius:
        return f"{place} is {clearance:.2f} m from a wall of the map, and the robot needs {radius:.2f} m"
    if start is not None and start in floor_map and not floor_map.is_connected(start, goal, radius):
        return (f"no way from the robot at ({start[0]:.2f}, {start[1]:.2f}) to {place}: walls of the map, or gaps "
                f"narrower than {2 * radius:.2f} m, lie between them")
    return None

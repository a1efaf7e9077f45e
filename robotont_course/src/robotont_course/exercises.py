"""The exercises: world, time, what differs from start to start, what the program needs, and the goal."""

from typing import Callable, NamedTuple, Tuple

from robotont_course import judge


class Exercise(NamedTuple):
    """One exercise."""

    world: str       # of config/worlds
    limit: float     # [s] from the program's start
    spread: Tuple[float, float, float]  # [m, m, rad] by which the start differs, at most
    goal: Callable[[judge.Run], str]    # what is missing at the end, in words
    camera: str = ""  # width x height of the camera's pictures; empty: none
    tags: float = 0.0  # [m] size of the tags that are looked for; 0: none


EXERCISES = {
    "square": Exercise("empty", 40.0, (1.0, 1.0, 3.1), judge.square),
    "distance": Exercise("bangbang", 25.0, (0.5, 0.4, 0.05), judge.keep_distance),
    "between": Exercise("between", 25.0, (0.3, 0.25, 0.2), judge.between),
    "line": Exercise("line", 50.0, (0.1, 0.05, 0.15), judge.follow_line, "424x240"),
    "colors": Exercise("colors", 40.0, (0.2, 0.2, 3.1), judge.find_red, "424x240"),
    "tag": Exercise("tags", 30.0, (0.4, 0.1, 0.25), judge.face_tag, "640x360", 0.25),
    "maze": Exercise("tags", 120.0, (0.2, 0.1, 0.25), judge.maze, "640x360", 0.25),
    "goal": Exercise("minimaze", 100.0, (0.1, 0.1, 3.1), judge.reach_goal),
}

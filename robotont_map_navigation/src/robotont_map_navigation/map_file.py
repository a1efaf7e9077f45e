"""The map that a launch file was given: whether there is one, before anything is started."""

import os
from pathlib import Path

from robotont_driver.parameters import parameters
from robotont_driver.parameters.files import read_mapping
from robotont_driver.parameters.parameters import is_number

NONE = "none"  # another node sends the map
ALLOWED = {  # in a map's file: whether a value is, and what
    "image": (lambda v: isinstance(v, str), "the name of a file"),
    "resolution": (lambda v: is_number(v) and v > 0, "a number > 0 [m]"),
    "origin": (lambda v: isinstance(v, list) and len(v) == 3 and all(map(is_number, v)), "[x, y, yaw], three numbers"),
    "occupied_thresh": (is_number, "a number"), "free_thresh": (is_number, "a number"),
    "negate": (lambda v: v in (0, 1), "0 or 1"),
}


def fault(file):
    """Why map_server cannot read a map file; None when it can."""
    if file == NONE:
        return None
    path = Path(file)
    if not os.path.exists(str(path)):
        worlds = sorted(other.stem for other in path.parent.glob("*.yaml"))
        beside = f" Beside it are: {', '.join(worlds)}." if worlds else ""
        return (f"no map {path}.{beside} A world of the simulator gets its map by: "
                "rosrun robotont_simulator make_map WORLD.yaml MAP")
    try:
        content, _ = read_mapping(path, ", ".join(ALLOWED))
    except (OSError, ValueError) as error:
        return str(error)
    for key, (valid, allowed) in ALLOWED.items():
        if not valid(content.get(key)):
            return f"{path}: {parameters.fault(key, content[key], allowed) if key in content else f'no {key}'}"
    image = path.parent / content["image"]
    return None if os.path.isfile(str(image)) else f"{path}: its image {image} is missing"

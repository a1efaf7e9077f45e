"""The map that a launch file was given: whether there is one, before anything is started."""

import argparse
import sys
from pathlib import Path

from robotont_driver.parameters.files import read_mapping

NONE = "none"  # another node sends the map


def fault(file):
    """Why map_server cannot read a map file; None when it can."""
    if file == NONE:
        return None
    path = Path(file)
    if not path.exists():
        worlds = sorted(other.stem for other in path.parent.glob("*.yaml"))
        beside = f" Beside it are: {', '.join(worlds)}." if worlds else ""
        return (f"no map {path}.{beside} A world of the simulator gets its map by: "
                "rosrun robotont_simulator make_map WORLD.yaml MAP")
    try:
        content, _ = read_mapping(path, "image, resolution and origin")
    except (OSError, ValueError) as error:
        return str(error)
    lacking = [key for key in ("image", "resolution", "origin") if key not in content]
    if lacking:
        return f"{path}: no {', '.join(lacking)}: not a map of map_server"
    image = path.parent / str(content["image"])
    return None if image.exists() else f"{path}: its image {image} is missing"


def main():
    """Print "true" when the map is there; else the reason on stderr, and exit with 1."""
    parser = argparse.ArgumentParser(description="Check that a map is there; used by launch files.")
    parser.add_argument("launch_file", help="who asks")
    parser.add_argument("map", help="file of map_server, or none")
    options = parser.parse_args()
    found = fault(options.map)
    if found:
        sys.exit(f"{options.launch_file}: {found}")
    print("true")

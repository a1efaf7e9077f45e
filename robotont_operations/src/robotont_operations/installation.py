"""Installation on a robot: files under a root folder, listed so that they can be removed to the last one."""

import os
import re
import shutil
from pathlib import Path
from typing import Mapping, NamedTuple, Tuple

from robotont_operations.robot_choice import with_robot

UNITS = ("robotont-master.service", "robotont.service", "robotont-recorder.service")
PAGE_UNIT, FLEET_UNIT = "robotont-page.service", "robotont-fleet.service"  # with --page, with --fleet
LIST = "etc/robotont/installed"    # every file and folder that the installation made, by their paths under the root
STATE = "var/lib/robotont"         # black boxes; made by systemd
KEPT = "etc/robotont/robot.conf"   # the user's own, not overwritten
ROS_VARIABLES = ("CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH", "PYTHONPATH", "ROS_DISTRO", "ROS_ETC_DIR",
                 "ROS_PACKAGE_PATH", "ROS_PYTHON_VERSION", "ROS_ROOT", "ROS_VERSION")
NETWORK_ONLINE = "Wants=network-online.target\nAfter=network-online.target\n"


class Installation(NamedTuple):
    """Contents of files by path under the root, and links (path under the root, target)."""

    files: Mapping[str, str]
    links: Tuple[Tuple[str, str], ...]
    robot: str  # to be put into a robot.conf that is there already; "": none


def installation(templates, udev_rules, environment, address="", robot="", model=True, page="", fleet=""):
    """The Installation of a robot.

    templates: folder of the units; udev_rules: paths of the rules; environment: that of a shell with the workspace
    sourced; address: IP address or host name under which other machines find the robot, "" for none. robot: of
    robot.launch; "": the one of before, or the thesis'. model: whether the robot's model can be made, for which there
    has to be xacro. page: address at which the page can be opened; "": there is none, or that of before. fleet: the
    same, of the computer of ./robotont fleet.
    """
    templates = Path(templates)
    files = {f"etc/udev/rules.d/{path.name}": path.read_text() for path in map(Path, udev_rules)}
    units = (*UNITS, *([PAGE_UNIT] if page else []), *([FLEET_UNIT] if fleet else []))
    for unit in units:
        text = (templates / unit).read_text().replace("@PAGE@", page).replace("@FLEET@", fleet)
        files["etc/systemd/system/" + unit] = text.replace("@NETWORK@", NETWORK_ONLINE if address else "")
    files["etc/sysusers.d/robotont.conf"] = (templates / "sysusers.conf").read_text()
    files["etc/robotont/python_logging.conf"] = (templates / "python_logging.conf").read_text()
    arguments = "ROBOTONT_ARGUMENTS=" + ("" if model else "description:=false")
    text = (templates / "robot.conf").read_text().replace("ROBOTONT_ARGUMENTS=", arguments)
    files[KEPT] = with_robot(text, robot)
    files["etc/robotont/environment"] = environment_file(environment, address)
    links = tuple((f"etc/systemd/system/multi-user.target.wants/{unit}", f"/etc/systemd/system/{unit}")
                  for unit in units)
    return Installation(files, links, robot)


def environment_file(environment, address):
    """Contents of the units' environment file: the workspace that was sourced, a master, and who may reach it."""
    host = address or "127.0.0.1"
    variables = {name: environment[name] for name in ROS_VARIABLES if environment.get(name)}
    prefixes = variables.get("CMAKE_PREFIX_PATH", "").split(":")
    variables["PATH"] = ":".join([prefix + "/bin" for prefix in prefixes if prefix] + ["/usr/local/bin:/usr/bin:/bin"])
    variables["ROS_MASTER_URI"] = f"http://{host}:11311"
    variables["ROS_HOSTNAME" if re.search("[a-zA-Z]", host) else "ROS_IP"] = host
    variables["ROS_HOME"] = "/" + STATE
    variables["ROS_PYTHON_LOG_CONFIG_FILE"] = "/etc/robotont/python_logging.conf"
    variables["PYTHONUNBUFFERED"] = "1"
    head = "# Written by ./robotont install-robot: run it again when the workspace has moved.\n"
    return head + "".join(f'{name}="{value}"\n' for name, value in sorted(variables.items()))


class LinkError(ValueError):
    """A path may lead out of the root folder: by a link on its way, or by its own text."""


def under(root, name):
    """The path of a name under `root`, no folder on the way to which is a link. Raises LinkError."""
    path = root
    if Path(name).is_absolute() or ".." in Path(name).parts:
        raise LinkError(f"found {name!r}, allowed: paths under {root}, without '..'")
    for part in Path(name).parts[:-1]:
        path /= part
        if path.is_symlink():
            raise LinkError(f"{path} is a link to {os.readlink(str(path))}; allowed: a folder")
    return path / Path(name).name


def _file(root, name):
    """As `under`, of a file that is to be read or written. Raises LinkError where it is a link."""
    path = under(root, name)
    if path.is_symlink():
        raise LinkError(f"{path} is a link to {os.readlink(str(path))}; allowed: a file")
    return path


def install(what, root):
    """Write an Installation under `root`; returns the paths under it that were written.

    Raises OSError; LinkError before anything is written.
    """
    root = Path(root)
    for name in (*what.files, LIST):
        _file(root, name)
    for name, _ in what.links:
        under(root, name)
    made = _listed(root)

    def make_folder(path):
        if not path.exists():
            make_folder(path.parent)
            path.mkdir()
            path.chmod(0o755)
            made.append(str(path.relative_to(root)))
    written = []
    for name, contents in what.files.items():
        path = root / name
        own = name == KEPT and path.exists()
        if own and not what.robot:
            continue
        text = with_robot(path.read_text(), what.robot) if own else contents
        make_folder(path.parent)
        path.write_text(text)
        path.chmod(0o644)
        written.append(name)
    for name, target in what.links:
        path = root / name
        make_folder(path.parent)
        if path.is_symlink():
            path.unlink()
        path.symlink_to(target)
        written.append(name)
    lines = dict.fromkeys((*made, *written, *(name for name in what.files if (root / name).exists()), LIST))
    (root / LIST).write_text("".join(line + "\n" for line in lines))
    return written


def installed_units(root):
    """Names of the services that are installed under `root`."""
    return [unit for unit in (*UNITS, PAGE_UNIT, FLEET_UNIT) if (Path(root) / "etc/systemd/system" / unit).exists()]


def installed(root):
    """Whether anything is installed under `root`. Raises LinkError."""
    return bool(_listed(Path(root)))


def remove(root):
    """Delete what `install` has made, and the black boxes.

    Returns (paths under `root` that are gone, words on each that was left because it leads out of it). Of a link the
    link goes, not what it leads to. Raises OSError, and LinkError before anything is deleted.
    """
    root = Path(root)
    gone, left = [], []
    for name in sorted(_listed(root), key=lambda name: name.count("/"), reverse=True):
        try:
            path = under(root, name)
        except LinkError as error:
            left.append(str(error))
            continue
        if path.is_symlink() or path.is_file():
            path.unlink()
        elif path.is_dir() and not any(path.iterdir()):
            path.rmdir()
        else:
            continue  # already deleted, or the folder holds other files
        gone.append(name)
    try:
        state = under(root, STATE)
    except LinkError as error:
        return gone, [*left, str(error)]
    if state.is_symlink():
        left.append(f"the black boxes, in {os.readlink(str(state))}, to which {state} was a link")
        state.unlink()
    elif state.exists():
        shutil.rmtree(state)
    else:
        return gone, left
    return [*gone, STATE], left


def _listed(root):
    path = _file(root, LIST)
    return path.read_text().splitlines() if path.exists() else []


def unreadable(paths):
    """The first folder on the way to one of the paths into which not every user may go; None if all may be read."""
    for path in map(Path, paths):
        for folder in (*reversed(path.resolve().parents), path.resolve()):
            if folder.is_dir() and not os.stat(str(folder)).st_mode & 0o001:
                return folder
    return None

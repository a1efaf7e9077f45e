"""Installation on a robot: which files lie where under a root folder, how they get there, and go again."""

import contextlib
import itertools
import os
import re
import shutil
from pathlib import Path

from robotont_driver.parameters.files import write_file

UNITS = ("robotont-master.service", "robotont.service", "robotont-recorder.service")
PAGE_UNIT, FLEET_UNIT = "robotont-page.service", "robotont-fleet.service"  # with --page, with --fleet
SYSTEMD, WANTED = "etc/systemd/system/", "etc/systemd/system/multi-user.target.wants/"
UDEV = "etc/udev/rules.d/"
USER = "etc/sysusers.d/robotont.conf"
SETTINGS = "etc/robotont/"
KEPT = SETTINGS + "robot.conf"     # the user's own, not overwritten
STATE = "var/lib/robotont"         # black boxes; made by systemd
ROS_VARIABLES = ("CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH", "PYTHONPATH", "ROS_DISTRO", "ROS_ETC_DIR",
                 "ROS_PACKAGE_PATH", "ROS_PYTHON_VERSION", "ROS_ROOT", "ROS_VERSION")
ROBOT_LINE = re.compile(r"^ROBOTONT_ROBOT=.*$", re.MULTILINE)
OURS = "Installed by ./robotont install-robot"  # in each of our units; the makers have a robotont.service, too
NETWORK_ONLINE = "Wants=network-online.target\nAfter=network-online.target\n"


def planned(templates, udev_rules, environment, options, model):
    """{path under the root: contents} of the files of a robot, and of its units' links {path: target}.

    templates: folder of the units; udev_rules: paths of the rules; environment: that of a shell with the workspace
    sourced; options: of install_robot's command line; model: whether the robot's model can be made, for which there
    has to be xacro.
    """
    templates = Path(templates)
    files = {UDEV + path.name: path.read_text() for path in map(Path, udev_rules)}
    words = {"@PAGE@": options.page, "@FLEET@": options.fleet, "@NETWORK@": options.network and NETWORK_ONLINE,
             "@RIGHTS@": (templates / "rights.conf").read_text().rstrip("\n")}
    units = (*UNITS, *([PAGE_UNIT] if options.page else []), *([FLEET_UNIT] if options.fleet else []))
    for unit in units:
        text = (templates / unit).read_text()
        for place, word in words.items():
            text = text.replace(place, word or "")
        files[SYSTEMD + unit] = text
    files[USER] = (templates / "sysusers.conf").read_text()
    files[SETTINGS + "python_logging.conf"] = (templates / "python_logging.conf").read_text()
    arguments = "ROBOTONT_ARGUMENTS=" + ("" if model else "description:=false")
    text = (templates / "robot.conf").read_text().replace("ROBOTONT_ARGUMENTS=", arguments)
    files[KEPT] = with_robot(text, options.robot)
    files[SETTINGS + "environment"] = environment_file(environment, options.network)
    return files, {WANTED + unit: "/" + SYSTEMD + unit for unit in units}


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


def with_robot(text, robot):
    """Contents of a robot.conf with that robot; "": as it is."""
    if not robot:
        return text
    line = "ROBOTONT_ROBOT=" + robot
    return ROBOT_LINE.sub(lambda _: line, text) if ROBOT_LINE.search(text) else text.rstrip("\n") + f"\n{line}\n"


def read(path):
    """Text of a file in whatever encoding; written by write_file it is the same bytes again."""
    return path.read_text("utf-8", "surrogateescape")


def install(files, links, robot, root):
    """Write what is `planned` under `root`; returns the paths under it that were written, and what was kept beside.

    robot: to be put into a robot.conf that is there already; "": none. A unit that is somebody else's gets another
    name. Raises OSError.
    """
    paths = {name: Path(root, name) for name in (*files, *links)}
    for path in map(paths.get, files):
        if path.is_symlink() or (path.exists() and not path.is_file()):  # a pipe, a device
            raise OSError(f"{path} is no file; allowed: a file")
    written = []
    for name, path in paths.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        if name in links:
            if path.is_symlink():
                path.unlink()
            path.symlink_to(links[name])
        elif name == KEPT and path.exists() and read(path).strip("\0\n "):  # not what a loss of power may leave
            if not robot:
                continue
            write_file(path, with_robot(read(path), robot))
        else:
            if name.startswith(SYSTEMD) and path.exists() and OURS not in read(path):
                written.append(f"{name} was another's: kept as {_kept_beside(path)}")
            write_file(path, files[name])
        written.append(name)
    return written


def _kept_beside(path):
    """The name of a file under a new one beside it, which systemd does not read."""
    for number in itertools.count(1):
        beside = path.with_name(f"{path.name}.before{number}")
        with contextlib.suppress(FileExistsError):
            os.link(str(path), str(beside))
            return beside.name


def installed_units(root):
    """Names of our services that are installed under `root`."""
    paths = [Path(root) / SYSTEMD / unit for unit in (*UNITS, PAGE_UNIT, FLEET_UNIT)]
    return [path.name for path in paths if path.is_file() and OURS in read(path)]


def remove(root, udev_rules):
    """Delete what `install` may have written, and the black boxes; returns the paths under `root` that are gone.

    udev_rules: paths of the rules. Of a link the link goes, not what it leads to. Raises OSError.
    """
    units = [place + unit for unit in installed_units(root) for place in (WANTED, SYSTEMD)]
    rules = [UDEV + Path(rule).name for rule in udev_rules]
    names = (*rules, USER, SETTINGS + "python_logging.conf", SETTINGS + "environment", KEPT, STATE,
             *units)  # last: by them one that broke off is found
    gone = []
    for name, path in [(name, Path(root, name)) for name in names]:
        if path.is_symlink():
            gone.append(f"{name} -> {os.readlink(str(path))}")
            path.unlink()
        elif path.exists():
            gone.append(name)
            (shutil.rmtree if path.is_dir() else os.unlink)(str(path))
    settings = Path(root, SETTINGS)
    if settings.is_dir() and not any(settings.iterdir()):  # what else lies there is the user's
        settings.rmdir()
    return gone


def unreadable(paths):
    """The first folder on the way to one of the paths into which not every user may go, or None."""
    folders = (folder for path in map(Path, paths) for folder in (*reversed(path.resolve().parents), path.resolve()))
    return next((folder for folder in folders if folder.is_dir() and not folder.stat().st_mode & 0o001), None)

"""./robotont where it does not stand as it should: another folder's name, rights, half a setup; and its help."""

import contextlib
import os
import pty
import re
import shutil
import subprocess
from pathlib import Path

import pip
import pytest

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = ["demo", "exercise", "sim", "keys", "rviz", "test", "bench", "which", "wheels", "flash", "lint", "docs",
            "shell", "build", "setup", "release", "update", "network", "status", "report", "fleet", "install-robot",
            "pictures"]
# Root may write everywhere; with these words before a command it may not.
WITHOUT_RIGHTS = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.getuid() == 0 else []


def clone(folder):
    """A copy of the script and of what it reads, without git, and nothing built."""
    folder.mkdir(parents=True)
    for name in ("robotont", "ruff.toml", "CMakeLists.txt", ".gitignore"):
        shutil.copy(str(ROOT / name), str(folder))
    for name in ("setup", "launch", "robotont_testing"):
        shutil.copytree(str(ROOT / name), str(folder / name))
    return folder


def clone_that_needs_nothing(folder):
    """A clone without packages, whose build takes seconds."""
    clone(folder)
    (folder / "setup" / "apt_packages.txt").write_text("")
    (folder / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.10)\nproject(none NONE)\n")
    return folder


def robotont(folder, *arguments, before=(), **environment):
    """Run ./robotont, behind the words `before`; in the clone's own folder, whichever the tests' own is."""
    return subprocess.run([*before, str(folder / "robotont"), *arguments], check=False, text=True, timeout=600,
                          env={**os.environ, "ROBOTONT_WORK": "", **environment}, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def functions(folder, script, **environment):
    """Run bash with the functions of setup/workspace.bash."""
    head = (f"set -euo pipefail; ROOT='{folder}'; WORK='{folder}/.build'; fail() {{ echo \"$*\"; exit 1; }}; "
            f". '{folder}/setup/workspace.bash'; ")
    return subprocess.run(["bash", "-c", head + script], env={**os.environ, **environment}, check=False, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=600)


def git(folder, *words):
    """Run git there; what it prints."""
    settings = ("user.name=a", "user.email=a@b.invalid", "init.defaultBranch=main")
    options = [word for setting in settings for word in ("-c", setting)]
    return subprocess.run(["git", "-C", str(folder), *options, *words], check=True, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT).stdout.strip()


def test_update_takes_the_newest_version_goes_back_and_touches_nothing_of_the_user(tmp_path):
    home = clone(tmp_path / "home")
    git(home, "init")
    for version in ("v1.0.0", "v1.9.0", "v1.10.0"):
        (home / "VERSION").write_text(version)
        git(home, "add", "-A")
        git(home, "commit", "-m", version)
        git(home, "tag", version)
    git(tmp_path, "clone", "-b", "v1.0.0", str(home), "robot")
    robot = tmp_path / "robot"
    (robot / "mine.yaml").write_text("kept")

    def now():
        return (robot / "VERSION").read_text(), (robot / "mine.yaml").read_text()
    assert "from v1.0.0 to v1.10.0; back: ./robotont update v1.0.0" in robotont(robot, "update").stdout
    assert now() == ("v1.10.0", "kept")
    assert robotont(robot, "update", "v1.0.0").returncode == 0
    assert now() == ("v1.0.0", "kept")
    wrong = robotont(robot, "update", "v3")
    assert (wrong.returncode, wrong.stdout.splitlines()[1]) == (
        1, "robotont: no version v3; allowed: v1.10.0, v1.9.0, v1.0.0, a commit (git log --all --oneline)")
    assert "this is v1.0.0 already" in robotont(robot, "update", "v1.0.0").stdout
    (robot / "VERSION").write_text("changed")
    refused = robotont(robot, "update")
    assert refused.returncode == 1
    assert " M VERSION" in refused.stdout
    assert now() == ("changed", "kept")
    git(robot, "commit", "-am", "mine")
    mine = git(robot, "rev-parse", "--short", "HEAD")
    assert f"git branch mine {mine} first" in robotont(robot, "update").stdout
    assert now() == ("changed", "kept")
    git(robot, "branch", "mine", mine)
    assert robotont(robot, "update").returncode == 0
    assert now() == ("v1.10.0", "kept")
    (home / "VERSION").write_text("newer")
    git(home, "commit", "-am", "newer")
    assert robotont(robot, "update", git(home, "rev-parse", "HEAD")).returncode == 0
    assert "newer than the newest version v1.10.0" in robotont(robot, "update").stdout
    assert now() == ("newer", "kept")
    git(robot, "remote", "set-url", "origin", str(tmp_path / "gone"))
    assert f"git fetch from {tmp_path / 'gone'} failed: fatal: " in robotont(robot, "update").stdout
    assert now() == ("newer", "kept")
    (home / "VERSION").write_text("newest")
    git(home, "commit", "-am", "newest")
    git(tmp_path, "clone", str(home), "teacher")
    for back in range(2):  # docs/robots.md: to a robot without internet, the way back, too
        git(tmp_path / "teacher", "checkout", f"HEAD~{back}")
        git(tmp_path / "teacher", "push", "-f", str(robot), "HEAD:refs/heads/teacher", "origin/HEAD:refs/heads/newest")
        assert robotont(robot, "update", "teacher").returncode == 0
        assert now() == (("newest", "newer")[back], "kept")
    assert robotont(robot, "update", "HEAD@{3}").returncode == 0, "the way back needs no network"
    assert now() == ("v1.10.0", "kept")


def test_an_update_that_has_failed_goes_on_and_neither_the_restart_nor_the_way_back_is_forgotten(tmp_path):
    home, robot, broken = clone_that_needs_nothing(tmp_path / "home"), tmp_path / "robot", tmp_path / "broken.cmake"
    git(home, "init")
    for version in ("v1.0.0", "v2.0.0"):
        with (home / "CMakeLists.txt").open("a") as lists:
            lists.write(f"include(../broken.cmake OPTIONAL)\nfile(WRITE ${{CMAKE_BINARY_DIR}}/built {version})\n")
        (home / "setup/pypi/calibration.txt").write_text(f"./none-of-{version}\n")
        git(home, "add", "-A")
        git(home, "commit", "-m", version)
        git(home, "tag", version)
    git(tmp_path, "clone", "-b", "v1.0.0", str(home), "robot")
    assert robotont(robot, "build").returncode == 0
    (robot / ".build" / "devel").mkdir()
    setup = robot / ".build/venv/setup"
    setup.mkdir(parents=True)
    (setup / "of_a_newer_version").touch()
    broken.write_text("message(FATAL_ERROR broken)")
    for _ in range(2):
        first = robotont(robot, "update")
        assert (first.returncode, first.stdout.splitlines()[-1]) == (
            1, "robotont: this version could not be built; back: ./robotont update v1.0.0")
    assert (robot / ".build" / "restart").exists(), "docs/robots.md: the class's loop asks for it"
    broken.unlink()
    again = robotont(robot, "update")
    assert again.returncode == 0, again.stdout
    assert "then restart the robot" in again.stdout
    assert (robot / ".build" / "build" / "built").read_text() == "v2.0.0"
    (setup / "calibration").touch()
    back = robotont(robot, "update", "v1.0.0")
    assert (back.returncode, (robot / ".build" / "build" / "built").read_text()) == (1, "v1.0.0"), back.stdout
    assert "it is built, but what its nodes need of PyPI has not come" in back.stdout


@pytest.mark.parametrize("waits", ["", "; back: ./robotont update v0.9.0\n"])
def test_an_update_that_git_refuses_leaves_version_and_restart_as_they_were(waits, tmp_path):
    home = clone_that_needs_nothing(tmp_path / "home")
    git(home, "init")
    for version in ("v1.0.0", "v2.0.0"):
        (home / f"new_in_{version}").touch()
        git(home, "add", "-A")
        git(home, "commit", "-m", version)
        git(home, "tag", version)
    git(tmp_path, "clone", "-b", "v1.0.0", str(home), "robot")
    robot = tmp_path / "robot"
    restart = robot / ".build/restart"
    restart.parent.mkdir()
    if waits:
        restart.write_text(waits)
    (robot / "new_in_v2.0.0").write_text("the user's")
    refused = robotont(robot, "update")
    assert (refused.returncode, refused.stdout.splitlines()[-1]) == (
        1, "robotont: git could not take v2.0.0: this is still v1.0.0")
    assert (restart.read_text() if restart.exists() else "") == waits
    with (robot / "CMakeLists.txt").open("a") as lists:
        lists.write("# changed\n")
    git(robot, "add", "CMakeLists.txt")
    advice = re.search(r"\((git checkout .*)FILE\)", robotont(robot, "update").stdout).group(1)
    git(robot, *advice.split()[1:], "CMakeLists.txt")
    assert "git could not take v2.0.0" in robotont(robot, "update").stdout
    git(home, "tag", "-f", "v2.0.0", "v1.0.0")
    moved = robotont(robot, "update").stdout
    assert (f"git fetch from {home} failed: " in moved, "rejected" in moved) == (True, True), moved
    shutil.rmtree(str(robot / ".git"))
    assert "not a git repository" in robotont(robot, "update", GIT_CEILING_DIRECTORIES=str(tmp_path)).stdout


def test_update_without_tags_takes_the_newest_commit_and_says_so(tmp_path):
    home = clone(tmp_path / "home")
    git(home, "init")
    git(home, "add", "-A")
    git(home, "commit", "-m", "older")
    git(tmp_path, "clone", str(home), "robot")
    robot = tmp_path / "robot"
    git(robot, "remote", "set-head", "origin", "--delete")  # as where init and fetch made the clone
    before = git(robot, "rev-parse", "--short", "HEAD")
    git(home, "commit", "--allow-empty", "-m", "newer")
    wrong = robotont(robot, "update", "v1.0.0")
    assert (wrong.returncode, wrong.stdout) == (
        1, "asking for versions\nrobotont: no version v1.0.0; allowed: a commit (git log --all --oneline)\n")
    said = robotont(robot, "update").stdout
    assert "no tags yet: taking the newest commit" in said
    assert f"back: ./robotont update {before}" in said
    assert git(robot, "rev-parse", "HEAD") == git(home, "rev-parse", "HEAD")
    assert robotont(robot, "update", before).returncode == 0
    assert git(robot, "rev-parse", "--short", "HEAD") == before
    assert not (robot / ".build/restart").exists(), "no service waits for it"
    script = home / "robotont"
    script.write_text(script.read_text().replace("\n  update  ", "\n  upgrade "))
    git(home, "commit", "-am", "knows no update")
    assert f"back: git checkout {before} && ./robotont build" in robotont(robot, "update").stdout


def test_a_shell_finds_our_packages_whatever_the_users_bashrc_puts_before_them(tmp_path):
    other = tmp_path / "bin/python3"
    other.parent.mkdir()
    other.write_text("#!/bin/sh\necho another python\n")
    other.chmod(0o755)
    (tmp_path / ".bashrc").write_text(f"export PATH={other.parent}:$PATH ROS_PACKAGE_PATH=/nowhere\n"
                                      "alias mine='echo kept'\n")
    here, there = pty.openpty()
    shell = subprocess.Popen([str(ROOT / "robotont"), "shell"], stdin=there, stdout=there, stderr=there, close_fds=True,
                             env={**os.environ, "HOME": str(tmp_path)}, start_new_session=True)
    os.close(there)
    os.write(here, b"mine; python3 -c 'import rospy; print(6 * 7)'; rospack find robotont_driver; exit\n")
    printed = b""
    with contextlib.suppress(OSError):  # its end
        while b"exit\r\n" not in printed.partition(b"42")[2]:
            printed += os.read(here, 4096)
    shell.wait(20.0)
    os.close(here)
    lines = printed.decode().splitlines()
    assert {"kept", "42", str(ROOT / "robotont_driver")} <= set(lines), printed.decode()


# one for each way of a command to its help: those that are programs stand in one table
@pytest.mark.parametrize("command", ["demo", "keys", "install-robot", "sim", "rviz", "test", "lint", "release"])
def test_every_command_answers_h(command, tmp_path):
    """Nothing built: without its own help, which would need a setup."""
    result = robotont(ROOT, command, "-h", ROBOTONT_WORK=str(tmp_path / "nothing"), COLUMNS="80")
    assert result.returncode == 0
    assert result.stdout.startswith(f"./robotont {command}: ")
    assert [line for line in result.stdout.splitlines() if len(line) > 80] == []
    named = {"sim": "--world", "demo": "--picture", "keys": "~linear_speed", "install-robot": "--network"}
    assert named.get(command, "") in result.stdout
    if command in ("keys", "release"):
        assert "__ns:=/NAMESPACE" in result.stdout
    assert not (tmp_path / "nothing").exists()


@pytest.mark.parametrize("answer, status, said", [
    ("success: True\nmessage: ''", 0, "success: True\nmessage: ''\n"),
    ("success: False\nmessage: 'success: True? ask again'", 1, "robotont: not released: 'success: True? ask again'\n")])
def test_a_release_that_is_refused_is_told_and_ends_with_1(answer, status, said, tmp_path):
    (tmp_path / "rosservice").write_text(f'#!/bin/sh\necho "{answer}"\n')
    (tmp_path / "rosservice").chmod(0o755)
    (tmp_path / "setup.bash").write_text(f"PATH={tmp_path}:$PATH\n")
    done = robotont(ROOT, "release", ROBOTONT_UNDERLAY=str(tmp_path))
    assert (done.returncode, done.stdout) == (status, said)
    services = "/robot1/emergency_stop/release\n/robot1/reset_odometry\n/robot2/emergency_stop/release"
    (tmp_path / "rosservice").write_text(f"#!/bin/sh\n[ $1 = list ] && printf '{services}'\n")
    assert robotont(ROOT, "release", ROBOTONT_UNDERLAY=str(tmp_path), ROS_MASTER_URI="http://x:1").stdout == (
        "robotont: not released: no robot answers at http://x:1; others do: ./robotont release __ns:=/robot1, "
        "./robotont release __ns:=/robot2\n")


@pytest.mark.parametrize("words", [["--version"], ["update", "--version"]])
def test_version(words):
    done = robotont(ROOT, *words)
    assert re.fullmatch(r"robotont \d+\.\d+\.\d+ commit \w{7,} of [\d-]+\n", done.stdout), done.stdout
    assert done.returncode == 0


def test_an_unknown_command_lists_those_that_there_are():
    result = robotont(ROOT, "fly")
    assert result.returncode == 1
    assert sorted(re.findall(r"^  ([a-z-]+) +\S", result.stdout, re.MULTILINE)) == sorted(COMMANDS)
    assert result.stdout.endswith("no such command: fly\n")


@pytest.mark.parametrize("arguments, words", [  # of arguments: one for each way of a command to take its own
    (["simm"], "no such command: simm; did you mean sim?"),
    (["sim", "wrold:=room"], "no argument --wrold; did you mean --world?"),
    (["sim", "frame_prefix:=a/"], "no argument --frame_prefix"),  # the launch file itself gives it a value
    (["keys", "--linear_speeds"], "no argument --linear_speeds; did you mean _linear_speed:=VALUE?"),
    (["report", "--outptu"], "no argument --outptu"), (["lint", "x"], "no argument x"),
    (["rviz"], "RViz needs a display, and DISPLAY is not set")])
def test_what_is_misspelt_or_cannot_be_is_refused(arguments, words):
    result = robotont(ROOT, *arguments, DISPLAY="")
    assert result.returncode != 0
    assert words in result.stdout


def test_a_folder_that_catkin_cannot_work_in_is_refused(tmp_path):
    folder = clone(tmp_path / "it's my; robot")
    result = robotont(folder, "build")
    assert result.returncode == 1
    assert f"  {folder}\n" in result.stdout
    assert "move the clone to another folder" in result.stdout
    assert not (folder / ".build").exists()


@pytest.mark.parametrize("forbidden", ["name", "folder", "lock"])
def test_a_clone_that_one_may_only_read_asks_for_another_folder(forbidden, tmp_path):
    folder = clone(tmp_path / "clone")
    work = folder / ".build"
    if forbidden == "name":
        work.write_text("a file where the folder would be")
    else:
        work.mkdir()
        (work / "lock").touch(0o444)
        work.chmod(0o555 if forbidden == "folder" else 0o755)
    result = robotont(folder, "build", before=WITHOUT_RIGHTS)
    work.chmod(0o755)
    assert result.returncode == 1
    assert result.stdout.startswith(f"robotont: {work} cannot be written to"), result.stdout
    assert "ROBOTONT_WORK=" in result.stdout


@pytest.mark.skipif(os.getuid() != 0, reason="only root can try what sudo does")
def test_what_sudo_builds_belongs_to_the_owner_of_the_clone(tmp_path):
    folder = clone_that_needs_nothing(tmp_path / "clone")
    os.chown(str(folder), 65534, 65534)
    result = robotont(folder, "build")
    assert result.returncode == 0, result.stdout
    assert {path.lstat().st_uid for path in (folder / ".build").rglob("*")} == {65534}


def test_a_build_goes_to_another_folder_where_nobody_else_may_write_and_needs_nothing_from_pypi(tmp_path):
    folder, work = clone_that_needs_nothing(tmp_path / "clone"), tmp_path / "work"
    folder.chmod(0o555)
    result = robotont(folder, "build", before=[*WITHOUT_RIGHTS, "bash", "-c", 'umask 000; exec "$@"', "bash"],
                      ROBOTONT_WORK=str(work), PIP_NO_INDEX="1")
    folder.chmod(0o755)
    assert result.returncode == 0, result.stdout
    assert not (folder / ".build").exists()
    made = [path for path in work.rglob("*") if not path.is_symlink()]
    assert {work / "build" / "Makefile", work / "lock"} <= set(made)
    assert not [path for path in made if path.stat().st_mode & 0o022]
    assert not list(work.glob("*/bin/python"))
    (folder / ".build" / "tools" / "lib" / "python3.11" / "site-packages").mkdir(parents=True)  # the tests' tools
    assert f"{folder}/.build/tools" not in functions(folder, "environment; echo $PYTHONPATH:$PATH").stdout


def test_half_a_virtual_environment_is_made_anew_and_the_callers_own_does_not_count(tmp_path):
    folder, site = clone(tmp_path / "clone"), tmp_path / "site"
    (folder / "setup" / "pypi" / "sim.txt").write_text("")
    (folder / "setup" / "pypi" / "lint.txt").write_text("elsewhere==1.0\n")
    venv = folder / ".build" / "venv"
    (venv / "bin").mkdir(parents=True)
    (venv / "bin" / "python").symlink_to("/usr/bin/python3")  # as when it was interrupted before pip came
    (venv / "pyvenv.cfg").write_text("home = /usr/bin\ninclude-system-site-packages = false\n")
    (folder / ".build" / "venv.new").mkdir()
    (folder / ".build" / "venv.new" / "half").write_text("")
    # with the tests' own pip beside it: to unpack one takes 8 s
    make = f"""/usr/bin/python3() {{
        command /usr/bin/python3 "$@" --without-pip
        ln -s {os.path.dirname(pip.__file__)} "${{@: -1}}"/lib/python*/site-packages
    }}; """
    result = functions(folder, make + "install_python venv sim")
    assert result.returncode == 0, result.stdout
    assert not (venv / "half").exists()
    (site / "elsewhere-1.0.dist-info").mkdir(parents=True)  # as in the shell of another clone
    (site / "elsewhere-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: elsewhere\nVersion: 1.0\n")
    result = functions(folder, "install_python venv lint", PYTHONPATH=str(site), PIP_NO_INDEX="1")
    assert result.returncode != 0, result.stdout
    assert "pip failed" in result.stdout


def test_another_workspace_lies_below_where_it_is_named(tmp_path):
    (tmp_path / "setup.bash").write_text('[ "$1" = --extend ] && export CMAKE_PREFIX_PATH=/below:$CMAKE_PREFIX_PATH')
    result = functions(ROOT, "environment; echo $CMAKE_PREFIX_PATH", CMAKE_PREFIX_PATH="/sourced",
                       ROBOTONT_UNDERLAY=str(tmp_path))
    assert result.stdout.startswith("/below:"), result.stdout
    assert "/sourced" not in result.stdout


def test_setup_of_a_group_installs_what_the_build_needs_too(tmp_path):
    """On a fresh system, where catkin is one of the group robot's packages."""
    folder, tools = clone_that_needs_nothing(tmp_path / "clone"), tmp_path / "tools"
    (folder / "setup" / "apt_packages.txt").write_text("robot catkin\ntest for-tests\n")
    (folder / "setup" / "pypi" / "test.txt").unlink()
    tools.mkdir()
    for name, line in (("dpkg-query", "exit 1"), ("apt-get", f'echo "$*" >>{tmp_path}/asked'), ("sudo", 'exec "$@"')):
        (tools / name).write_text(f"#!/bin/sh\n{line}\n")
        (tools / name).chmod(0o755)
    result = robotont(folder, "setup", "test", PATH=f"{tools}:{os.environ['PATH']}")
    assert "ready: test" in result.stdout, result.stdout
    assert "--no-install-recommends catkin for-tests" in (tmp_path / "asked").read_text()


def test_each_group_installs_its_own_and_again_what_was_deleted(tmp_path):
    folder = clone(tmp_path / "clone")
    script = 'install_packages() { echo "packages $*"; }; install_python() { echo "python $*"; mkdir -p .build/$1; }; '
    result = functions(folder, f"cd '{folder}'; {script} for groups in 'robot flash' 'robot flash sim' 'robot sim'; "
                               "do setup $groups; finish_setup; done; rm -r .build/tools; "
                               "for turn in 1 2; do setup robot sim flash; finish_setup; done")
    assert result.stdout.splitlines() == ["packages robot flash", "python tools flash",
                                          "packages sim", "python venv sim",
                                          "packages flash", "python tools flash"]


@pytest.mark.parametrize("system, ros, found", [
    ("gentoo-2", "", "gentoo-2 is not in setup/systems.txt: install these packages"),
    ("ubuntu-22.04", "", "no ROS 1 in /opt/ros: docs/reference.md, \"Systems\", tells how it comes to ubuntu-22.04"),
    ("ubuntu-22.04", "/opt/ros/one", "apt-get install"),
])
def test_an_unknown_system_gets_one_clear_line(system, ros, found, tmp_path):
    folder = clone(tmp_path / "clone")
    (folder / ".build").mkdir()
    result = functions(folder, f"system_name() {{ echo {system}; }}; opt_ros() {{ echo {ros}; }}; "
                       "dpkg-query() { return 1; }; as_root() { echo \"$*\" >&3; }; exec 3>&1; install_packages robot")
    assert found in result.stdout
    assert "depthimage" not in result.stdout.replace("ros-noetic-depthimage", "")
    assert ("apt-get" in result.stdout) == bool(ros)
    assert result.returncode == (0 if ros else 1)


def test_a_copied_clone_is_built_anew(tmp_path):
    first, second = clone(tmp_path / "first"), tmp_path / "second"
    prepare = "setup() { :; }; build() { :; }; prepare"
    assert functions(first, prepare).stdout == ""
    for name in ("build", "devel", "tools"):
        (first / ".build" / name).mkdir()
        (first / ".build" / name / "of_first").write_text("")
    assert functions(first, prepare).stdout == ""
    assert len(list((first / ".build").glob("*/of_first"))) == 3
    for group in ("venv/setup/fleet", "tools/setup/lint"):
        (first / ".build" / group).parent.mkdir(parents=True)
        (first / ".build" / group).touch()
    shutil.copytree(str(first), str(second))
    assert (f"moved or copied from {first} {first}/.build: rebuilt; for all that was here: ./robotont setup fleet lint"
            in functions(second, prepare).stdout)
    assert not list((second / ".build").glob("*/of_first"))

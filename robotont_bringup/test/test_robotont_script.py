"""./robotont where it does not stand as it should: another folder's name, rights, half a setup; and its help."""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import urllib.request
from pathlib import Path

import pytest

from robotont_testing.harness import free_port, wait_for

ROOT = Path(__file__).resolve().parents[2]
COMMANDS = ["demo", "sim", "keys", "rviz", "test", "bench", "wheels", "flash", "pictures", "lint", "shell", "build",
            "setup", "release", "network", "status", "report", "install-robot"]
# Root may write everywhere; with these words before a command it may not.
WITHOUT_RIGHTS = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.getuid() == 0 else []


def clone(folder):
    """A copy of the script and of what it reads, without git, and nothing built."""
    folder.mkdir(parents=True)
    for name in ("robotont", "ruff.toml", "CMakeLists.txt", ".gitignore"):
        shutil.copy(str(ROOT / name), str(folder))
    for name in ("setup", "launch", "robotont_testing"):
        shutil.copytree(str(ROOT / name), str(folder / name))
    (folder / "docs").mkdir()
    shutil.copy(str(ROOT / "docs" / "systems.md"), str(folder / "docs"))
    return folder


def clone_that_needs_nothing(folder):
    """A clone without packages, whose build takes seconds."""
    clone(folder)
    (folder / "setup" / "packages.txt").write_text("")
    (folder / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.10)\nproject(none NONE)\n")
    return folder


def robotont(folder, *arguments, before=(), **environment):
    """Run ./robotont, behind the words `before`; in the clone's own folder, whichever the tests' own is."""
    return subprocess.run([*before, str(folder / "robotont"), *arguments], check=False, text=True, timeout=120,
                          env={**os.environ, "ROBOTONT_WORK": "", **environment}, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def functions(folder, script, **environment):
    """Run bash with the functions of setup/workspace.bash, and with no package manager."""
    head = (f"set -euo pipefail; ROOT='{folder}'; WORK='{folder}/.build'; fail() {{ echo \"$*\"; exit 1; }}; "
            f". '{folder}/setup/workspace.bash'; install_packages() {{ :; }}; ")
    return subprocess.run(["bash", "-c", head + script], env={**os.environ, **environment}, check=False, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=120)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_answers_h(command, tmp_path):
    """Nothing built: without its own help, which would need a setup."""
    result = robotont(ROOT, command, "-h", ROBOTONT_WORK=str(tmp_path / "nothing"))
    assert result.returncode == 0
    assert result.stdout.startswith(f"./robotont {command}: ")
    assert not (tmp_path / "nothing").exists()


def test_an_unknown_command_lists_those_that_there_are():
    result = robotont(ROOT, "fly")
    assert result.returncode == 1
    assert sorted(re.findall(r"^  ([a-z-]+) +\S", result.stdout, re.MULTILINE)) == sorted(COMMANDS)
    assert "no such command: fly" in result.stdout


@pytest.mark.parametrize("name", ["my robot", "a;b", "it's", "a&b", "a:b"])
def test_a_folder_that_catkin_cannot_work_in_is_refused(name, tmp_path):
    folder = clone(tmp_path / name)
    result = robotont(folder, "build")
    assert result.returncode == 1
    assert f"  {folder}\n" in result.stdout
    assert "move the clone to another folder" in result.stdout
    assert not (folder / ".build").exists()


def test_a_clone_that_one_may_only_read_asks_for_another_folder(tmp_path):
    folder = clone(tmp_path / "clone")
    (folder / ".build").write_text("a file where the folder would be: root may write everywhere else")
    result = robotont(folder, "build")
    assert result.returncode == 1
    assert f"{folder}/.build cannot be written to" in result.stdout
    assert "ROBOTONT_WORK=" in result.stdout


@pytest.mark.parametrize("forbidden", ["folder", "lock"])
def test_a_clone_of_another_user_asks_for_another_folder(forbidden, tmp_path):
    folder = clone(tmp_path / "clone")
    work = folder / ".build"
    work.mkdir()
    if forbidden == "lock":
        (work / "lock").touch(0o444)
    else:
        work.chmod(0o555)
    result = robotont(folder, "build", before=WITHOUT_RIGHTS)
    work.chmod(0o755)
    assert result.returncode == 1
    assert result.stdout.startswith(f"robotont: {work} cannot be written to"), result.stdout


def test_another_folder_takes_all_that_is_made(tmp_path):
    folder, work = clone_that_needs_nothing(tmp_path / "clone"), tmp_path / "work"
    folder.chmod(0o555)
    result = robotont(folder, "build", before=WITHOUT_RIGHTS, ROBOTONT_WORK=str(work))
    folder.chmod(0o755)
    assert result.returncode == 0, result.stdout
    assert (work / "build" / "Makefile").exists()
    assert not (folder / ".build").exists()


def test_nobody_else_may_write_what_is_built_nor_is_half_an_environment_taken_for_one(tmp_path):
    folder = clone_that_needs_nothing(tmp_path / "clone")
    (folder / "setup" / "pypi" / "lint.txt").write_text("# none\n")
    interrupted = folder / ".build" / "tools.new"
    interrupted.mkdir(parents=True)
    (interrupted / "half").write_text("")
    result = robotont(folder, "setup", "robot", "lint", before=["bash", "-c", 'umask 000; exec "$@"', "bash"])
    assert result.returncode == 0, result.stdout
    made = [path for path in (folder / ".build").rglob("*") if not path.is_symlink()]
    assert folder / ".build" / "lock" in made
    assert not [path for path in made if path.stat().st_mode & 0o022]
    assert (folder / ".build" / "tools" / "bin" / "pip").exists()
    assert not (folder / ".build" / "tools" / "half").exists()


def test_half_a_virtual_environment_is_made_anew(tmp_path):
    folder = clone(tmp_path / "clone")
    (folder / "setup" / "pypi" / "sim.txt").write_text("")
    venv = folder / ".build" / "venv"
    (venv / "bin").mkdir(parents=True)
    (venv / "bin" / "python").symlink_to("/usr/bin/python3")  # as when it was interrupted before pip came
    (venv / "pyvenv.cfg").write_text("home = /usr/bin\ninclude-system-site-packages = false\n")
    result = functions(folder, "install_python venv sim")
    assert result.returncode == 0, result.stdout
    assert subprocess.run([str(venv / "bin" / "python"), "-m", "pip", "--version"], check=False,
                          stdout=subprocess.DEVNULL).returncode == 0


def test_what_only_the_callers_environment_has_does_not_count_as_installed(tmp_path, monkeypatch):
    folder, site = clone(tmp_path / "clone"), tmp_path / "site"
    (folder / "setup" / "pypi" / "sim.txt").write_text("elsewhere==1.0\n")
    (site / "elsewhere-1.0.dist-info").mkdir(parents=True)
    (site / "elsewhere-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: elsewhere\nVersion: 1.0\n")
    monkeypatch.setenv("PYTHONPATH", str(site))  # as in the shell of another clone
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    result = functions(folder, "install_python venv sim")
    assert result.returncode != 0, result.stdout
    assert "pip failed" in result.stdout


def test_a_robot_needs_nothing_from_pypi(tmp_path, monkeypatch):
    """A build, and the environment of nodes after the tests' tools have come."""
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    folder = clone_that_needs_nothing(tmp_path / "clone")
    result = robotont(folder, "build")
    assert result.returncode == 0, result.stdout
    assert not list((folder / ".build").glob("*/bin/python"))
    (folder / ".build" / "tools" / "lib" / "python3.11" / "site-packages").mkdir(parents=True)
    assert "tools" not in functions(folder, "environment; echo $PYTHONPATH:$PATH").stdout


def test_each_group_installs_its_own_and_again_what_was_deleted(tmp_path):
    folder = clone(tmp_path / "clone")
    script = 'install_packages() { echo "packages $*"; }; install_python() { echo "python $*"; mkdir -p .build/$1; }; '
    result = functions(folder, f"cd '{folder}'; {script} setup robot flash; setup robot flash sim; setup robot sim; "
                               "rm -r .build/tools; setup robot sim flash; setup robot sim flash")
    assert result.stdout.splitlines() == ["packages robot flash", "python tools flash",
                                          "packages sim", "python venv sim",
                                          "packages flash", "python tools flash"]


@pytest.mark.parametrize("system, ros, found", [
    ("gentoo-2", "", "gentoo-2 is not in docs/systems.md: install these packages"),
    ("ubuntu-22.04", "", "no ROS 1 in /opt/ros: docs/systems.md tells how it comes to ubuntu-22.04"),
    ("ubuntu-22.04", "/opt/ros/one", "apt-get install"),
])
def test_an_unknown_system_gets_one_clear_line(system, ros, found, tmp_path):
    folder = clone(tmp_path / "clone")
    (folder / ".build").mkdir()
    head = (f"set -euo pipefail; ROOT='{folder}'; WORK='{folder}/.build'; fail() {{ echo \"$*\"; exit 1; }}; "
            f". '{folder}/setup/workspace.bash'; system_name() {{ echo {system}; }}; opt_ros() {{ echo {ros}; }}; "
            "dpkg-query() { return 1; }; as_root() { echo \"$*\" >&3; }; exec 3>&1; install_packages robot")
    result = subprocess.run(["bash", "-c", head], check=False, text=True, stdout=subprocess.PIPE,
                            stderr=subprocess.STDOUT)
    assert found in result.stdout
    assert "depthimage" not in result.stdout.replace("ros-noetic-depthimage", "")
    assert ("apt-get" in result.stdout) == bool(ros)
    assert result.returncode == (0 if ros else 1)


@pytest.mark.parametrize("how", ["moved", "copied"])
def test_a_clone_in_another_place_is_built_anew(how, tmp_path):
    first, second = clone(tmp_path / "first"), tmp_path / "second"
    prepare = "setup() { :; }; build() { :; }; prepare"
    assert functions(first, prepare).stdout == ""
    for name in ("build", "devel", "tools"):
        (first / ".build" / name).mkdir()
        (first / ".build" / name / "of_first").write_text("")
    assert functions(first, prepare).stdout == ""
    assert len(list((first / ".build").glob("*/of_first"))) == 3
    shutil.copytree(str(first), str(second))
    if how == "moved":
        shutil.rmtree(str(first))
    assert f"moved or copied from {first}: rebuilt" in functions(second, prepare).stdout
    assert not list((second / ".build").glob("*/of_first"))


def test_a_misspelt_argument_of_sim_is_refused():
    result = robotont(ROOT, "sim", "world:=room", "wrold:=room")
    assert result.returncode != 0
    assert "no argument wrold:=room; there are: address " in result.stdout + (result.stderr or "")


@contextlib.contextmanager
def started(*command, **options):
    """A running command; ended as Ctrl-C does."""
    process = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, start_new_session=True,
                               **options)
    try:
        yield
    finally:
        os.killpg(process.pid, signal.SIGINT)
        process.wait(60.0)


def test_sim_says_how_to_drive_on_and_that_drives(tmp_path):
    """Its words are taken as they are printed, into a terminal without ROS' environment."""
    kept = {name: os.environ[name] for name in ("HOME", "ROBOTONT_LIFELINE") if name in os.environ}
    terminal = {**kept, "PATH": "/usr/bin:/bin", "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}",
                "ROS_LOG_DIR": str(tmp_path)}
    log, web_port = tmp_path / "log", free_port()
    with open(str(log), "wb") as output, \
            started(ROOT / "robotont", "sim", f"port:={tmp_path}/board", f"web_port:={web_port}",
                    env=terminal, stdout=output, stderr=output):
        wait_for(lambda: "Ctrl-C here ends all of it." in log.read_text(), "the hint", 60.0, 0.1)
        page, = re.findall(r"Drive it in a browser: (\S+)", log.read_text())
        assert b"<html" in urllib.request.urlopen(page, timeout=10.0).read()
        drive, = re.findall(r"by a topic +(.*)", log.read_text())
        with started("bash", "-c", drive, env=terminal, cwd="/", stdout=subprocess.DEVNULL):
            odometry = 'rostopic echo -n 1 --filter "m.twist.twist.linear.x > 0.15" odom'
            subprocess.run([str(ROOT / "robotont"), "shell", "-c", odometry], env=terminal, check=True,
                           stdout=subprocess.DEVNULL, timeout=60.0)
        tools, = re.findall(r"ROS' tools +(.*?) +\(", log.read_text())
        subprocess.run(["bash", "-c", tools + " -c 'rosrun robotont_driver which_robot -h'"], env=terminal, check=True,
                       stdout=subprocess.DEVNULL, timeout=60.0)


def test_lint_needs_no_git_and_leaves_what_is_built_alone(tmp_path):
    text = (ROOT / "robotont").read_text() + (ROOT / "setup" / "workspace.bash").read_text()
    assert "git " not in text.replace("git-", "")
    archive = clone(tmp_path / "archive")
    (archive / ".build" / "devel").mkdir(parents=True)
    (archive / ".build" / "devel" / "others.py").write_text("")
    result = subprocess.run(["ruff", "check", "--show-files", "."], cwd=str(archive), check=True, text=True,
                            stdout=subprocess.PIPE)
    assert f"{archive}/robotont_testing/setup.py" in result.stdout
    assert "others.py" not in result.stdout

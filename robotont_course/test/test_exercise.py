"""./robotont exercise: a student's program in the simulator."""

import contextlib
import csv
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from robotont_course import judge, stage
from robotont_course.exercise import main, parse, show_list, show_task, texts
from robotont_course.exercises import EXERCISES
from robotont_course.picture import draw_class
from robotont_simulator.world import World, box

PACKAGE = Path(__file__).resolve().parents[1]
SOLUTIONS = PACKAGE / "test" / "solutions"
EXERCISE = [sys.executable, str(PACKAGE / "scripts" / "exercise")]
SEEDS = int(os.environ.get("ROBOTONT_SEEDS", "20"))
HEAD = "import rospy\nfrom geometry_msgs.msg import Twist\nrospy.init_node('mine')\n" \
       "publisher = rospy.Publisher('cmd_vel', Twist, queue_size=1)\ntwist = Twist()\nrospy.sleep(1.0)\n"
LOOP = "while not rospy.is_shutdown():\n    publisher.publish(twist)\n    rospy.sleep(0.1)\n"
WRONG = {  # programs of exercise 2 by what is wrong: the text, and what the judge says
    "never_stops": (HEAD + "twist.linear.x = 0.3\n" + LOOP, "touched a wall"),
    "slow": (HEAD + "twist.linear.x = 0.02\n" + LOOP, "the time is over"),
    "wrong_sign": (HEAD + "twist.linear.x = -0.2\n" + LOOP, "drove away from the wall"),
    "turns": (HEAD + "twist.angular.z = 1.0\n" + LOOP, "does not stand at the end"),
    "stands": (HEAD + LOOP, "stands 1.95 m from the wall"),
    "sleeps_10_s": (HEAD + "twist.linear.x = 0.2\nfor _ in range(30):\n    publisher.publish(twist)\n"
                    "    rospy.sleep(0.1)\nrospy.sleep(10.0)\n", "no command for"),
    "endless_loop": ("while True:\n    pass\n", "published nothing on cmd_vel"),
    "endless_recursion": ("def f():\n    f()\nf()\n", "RecursionError"),
    "syntax_error": ("print('a'\n", "SyntaxError"),
    "name_error": (HEAD + "twist.linear.x = speed\n" + LOOP, "line 7: NameError"),
    "no_module": ("import no_such_module\n", "ModuleNotFoundError"),
    "empty": ("", "published nothing"),
    "nan": (HEAD + "twist.linear.x = float('nan')\n" + LOOP, "not a number"),
    "infinite": (HEAD + "twist.linear.x = float('inf')\n" + LOOP, "not a number"),
    "once": (HEAD + "twist.linear.x = 0.2\npublisher.publish(twist)\nrospy.spin()\n", "published one command only"),
    "another_topic": (HEAD.replace("cmd_vel", "cmd_val") + "twist.linear.x = 0.2\n" + LOOP,
                      "but on /cmd_val (geometry_msgs/Twist)"),
    "two_nodes": ("import os\nwho = os.fork()\n" + HEAD.replace("'mine'", "'mine' if who else 'other'")
                  + "twist.linear.x = 0.1\n" + LOOP, "2 nodes publish on cmd_vel"),
    "floods": (HEAD + "twist.linear.x = 0.1\nwhile not rospy.is_shutdown():\n    publisher.publish(twist)\n",
               "commands a second"),
    "prints": ("while True:\n    print('x' * 1000)\n", "it printed more than 10 MB"),
    "ends_its_parents_group": ("import os, signal\nos.killpg(os.getpgid(os.getppid()), signal.SIGKILL)\n",
                               "ended by an error"),
    "forks_and_ends": ("import os, time\nend = time.monotonic() + 120\nfor _ in range(20):\n    if not os.fork():\n"
                       "        break\nwhile time.monotonic() < end:\n"  # else a fault would run on for ever
                       "    if os.fork():\n        os._exit(0)\n    time.sleep(0.01)\n", "published nothing"),
    "removes_its_folder": ("import shutil\nshutil.rmtree('.')\nraise SystemExit(5)\n", "ended by an error"),
    "stamped": (HEAD.replace("Twist", "TwistStamped") + LOOP, "but on /cmd_vel (geometry_msgs/TwistStamped)"),
    "eats_memory": ("x = []\nwhile True:\n    x.append(bytes(10 ** 8))\n", "MemoryError"),
    "fills_the_disk": ("with open('big', 'wb') as file:\n    while True:\n        file.write(bytes(10 ** 7))\n",
                       "ended by an error"),
    "opens_a_window": ("import tkinter\ntkinter.Tk()\n", "ended by an error"),
    "asks": (HEAD + "input('speed? ')\n" + LOOP, "EOFError"),
    "exits_with_3": ("import sys\nsys.exit(3)\n", "ended by an error: 3"),
    "kills_itself": ("import os, signal\nos.kill(os.getpid(), signal.SIGKILL)\n", "ended by an error"),
    "ignores_ctrl_c": ("import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\nsignal.signal(signal.SIGTERM, "
                       "signal.SIG_IGN)\nwhile True:\n    pass\n", "published nothing"),
    "leaves_children": ("import subprocess, sys\nfor _ in range(5):\n    subprocess.Popen([sys.executable, '-c', "
                        "'while True: pass'], start_new_session=True)\n", "published nothing"),
    "lies": ("import rospy\nfrom nav_msgs.msg import Odometry\nrospy.init_node('mine')\n"
             "publisher = rospy.Publisher('ground_truth/odom', Odometry, queue_size=1)\nlie = Odometry()\n"
             "lie.pose.pose.position.x = 1.35\nlie.pose.pose.orientation.w = 1.0\n"
             "while not rospy.is_shutdown():\n    lie.header.stamp = rospy.Time.now()\n    publisher.publish(lie)\n"
             "    rospy.sleep(0.01)\n", "but on /ground_truth/odom"),
    "takes_its_name": ("import rospy\nrospy.init_node('simulator_node')\nrospy.spin()\n",
                       "took the name /simulator_node"),
    "stops_too_far": (HEAD + "twist.linear.x = 0.2\nfor _ in range(20):\n    publisher.publish(twist)\n"
                      "    rospy.sleep(0.1)\n", "from the wall, 0.55 to 0.65 m wanted"),
}


def solved(name, folder):
    """The template with the reference solution at its marked place: a file."""
    text = re.sub("(# ---- your code ----\n).*?(# ---- end)", lambda found: found[1] + "\n"
                  + (SOLUTIONS / f"{name}.py").read_text() + found[2], texts(name)[1],
                  flags=re.DOTALL)
    file = Path(folder) / f"{name}.py"
    file.write_text(text)
    return file


def exercise(*words):
    return subprocess.run([*EXERCISE, *map(str, words)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False, timeout=400)


def test_the_list_and_a_number_in_place_of_a_name(capsys):
    show_list()
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("2  distance   keep a distance")
    assert len(lines) == len(EXERCISES) + 1
    assert parse(["2"]).name == parse(["distance"]).name == "distance"


@pytest.mark.parametrize("words, found", [
    (["square", "photo.png"], "photo.png', allowed: a program, a file NAME.py that is there"),  # which it drew over
    (["square", "folder.py"], "folder.py', allowed"), (["square", "none.py"], "none.py', allowed"),
    (["square", "--class", "."], "found no programs, *.py, in ."), (["9"], "invalid choice"),
    (["square", "a.py", "--seed", "-1"], "allowed: 0 and more"), (["--class", "."], "found no NAME")])
def test_what_is_no_program_is_refused_before_anything_starts(words, found, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "photo.png").touch()
    (tmp_path / "folder.py").mkdir()
    (tmp_path / "broken.py").symlink_to("none")
    if "a.py" in words:
        (tmp_path / "a.py").touch()
    with pytest.raises(SystemExit):
        parse(words)
    assert found in capsys.readouterr().err


def test_a_folder_that_cannot_be_written_is_told_without_a_traceback(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "square.py").symlink_to("none/square.py")
    monkeypatch.setattr(sys, "argv", ["exercise", "square"])
    assert main() == 2
    assert "square.py: No such file or directory: is there room" in capsys.readouterr().err


@pytest.mark.parametrize("program", [WRONG["forks_and_ends"][0], WRONG["ignores_ctrl_c"][0],
                                     WRONG["leaves_children"][0], WRONG["ends_its_parents_group"][0], ""])
def test_nothing_that_a_program_has_started_is_left(program, tmp_path):
    (tmp_path / "a.py").write_text(program)
    output = tmp_path / f"output_{os.getpid()}"
    process = stage.start_program(tmp_path / "a.py", output)
    time.sleep(0.5)  # in which it starts, or ends
    stage.end_program(process, output.name)
    assert process.returncode is not None
    for _ in range(50):  # those that fork away are found by chance
        assert not [one for one in Path("/proc").glob("[0-9]*/environ") if marked(one, output.name)]


class Standing:
    """A `stage.Witness` of a robot that stands."""

    def __init__(self):
        self.commands, self._begin = [], time.monotonic()

    heard = property(lambda self: time.monotonic())
    rows = property(lambda self: [
        (number / 50, *5 * [0.0]) for number in range(2 + int(50 * (time.monotonic() - self._begin)))])


@pytest.mark.parametrize("program, said", [
    (WRONG["exits_with_3"][0], "ended by an error: 3"), (WRONG["kills_itself"][0], "ended by an error: SIGKILL"),
    (WRONG["ends_its_parents_group"][0], "ended by an error: SIGKILL"), (WRONG["prints"][0], "more than 10 MB"),
    (WRONG["removes_its_folder"][0], "ended by an error"), (WRONG["asks"][0].replace(HEAD, ""), "EOFError"),
    ("", "published no geometry_msgs/Twist on cmd_vel, but on /x (y)"),
    ("print('[/judged] Reason: new node registered with same name')", "took the name /judged")])
def test_how_a_program_ended_is_told(program, said, tmp_path, monkeypatch):
    """The way of `stage.play`, without a simulator."""
    monkeypatch.setattr(stage, "nodes", lambda: {"/judged"})
    monkeypatch.setattr(stage, "published", lambda robots: ("/x (y)",))
    exercise = EXERCISES["distance"]._replace(limit=20.0)
    (tmp_path / "home").mkdir()
    (tmp_path / "a.py").write_text(program)
    world = World((box(2.0, 0.0, 0.1, 4.0, 0.0),))
    run, ended, _ = stage.play(exercise, tmp_path / "a.py", world, Standing(), tmp_path / "home")
    assert said in "; ".join(words for _, words in judge.faults(exercise, run, ended))
    assert run.path[-1, 0] < 15.0


@pytest.mark.parametrize("program, said", [
    ("import time\ntime.sleep(60)\n", ""), (WRONG["endless_loop"][0], ""),
    ("print('[/judged] Reason: new node registered with same name')", "took the name /judged")])
def test_a_simulator_that_falls_silent_is_the_stages_fault_unless_the_program_took_its_name(
        program, said, tmp_path, monkeypatch):
    def gone(_robots):
        raise ConnectionRefusedError
    monkeypatch.setattr(stage, "nodes", lambda: {"/judged"})
    monkeypatch.setattr(stage, "published", gone)  # with the simulator the whole stack ends, its master, too
    printed = tmp_path / "home" / f"output_{os.getpid()}"
    monkeypatch.setattr(Standing, "heard", property(
        lambda self: time.monotonic() if said and not printed.stat().st_size else 0.0))
    monkeypatch.setattr(Standing, "rows", [(0.0, *5 * [0.0]), (0.1, *5 * [0.0])])
    (tmp_path / "home").mkdir()
    (tmp_path / "a.py").write_text(program)
    arguments = EXERCISES["distance"], tmp_path / "a.py", World((box(2.0, 0.0, 0.1, 4.0, 0.0),)), Standing()
    if said:
        run, ended, _ = stage.play(*arguments, tmp_path / "home")
        assert said in "; ".join(words for _, words in judge.faults(arguments[0], run, ended))
    else:
        with pytest.raises(stage.StackError, match="the simulator has said nothing for 3 s"):
            stage.play(*arguments, tmp_path / "home")


def marked(environment, name):
    with contextlib.suppress(OSError):
        return f"{stage.MARK}={name}".encode() in environment.read_bytes().split(b"\0") and \
            b"Z" not in (environment.parent / "stat").read_bytes().rpartition(b")")[2]
    return False


@pytest.mark.parametrize("words", ["NameError: $x_{ $", "\udcff", "a\nb"])
def test_any_words_become_a_title(words, tmp_path):
    run = judge.Run(np.zeros((2, 6)), World(), 0.2)
    draw_class([(run, [], words), (None, [(0.0, words)], words)], tmp_path / "b.png")
    assert (tmp_path / "b.png").stat().st_size > 1000


@pytest.mark.parametrize("name", EXERCISES)
def test_every_exercise_has_a_task_and_a_template_with_one_marked_place(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    show_task(name)
    assert f"./robotont exercise {name} {name}.py" in capsys.readouterr().out
    text = (tmp_path / f"{name}.py").read_text()
    assert text.count("# ---- your code") == text.count("# ---- end of your code") == 1
    assert f"within {EXERCISES[name].limit:g} s" in re.sub(r"\s+", " ", texts(name)[0])
    compile(solved(name, tmp_path).read_text(), name, "exec")


def test_a_right_program_passes(tmp_path):
    done = exercise("distance", solved("distance", tmp_path), "--seed", "3")
    assert done.returncode == 0, done.stdout


@pytest.mark.nightly
def test_a_class_of_a_right_program_and_a_wrong_one(tmp_path):
    solved("distance", tmp_path)
    text, said = WRONG["name_error"]
    (tmp_path / "wrong.py").write_text(text)
    done = exercise("distance", "--class", tmp_path, "--seed", "3")
    assert done.returncode == 0, done.stdout
    right, wrong = table(tmp_path)
    assert (right["file"], right["result"], right["stands at the end"]) == ("distance.py", "passed", "yes"), done.stdout
    assert (wrong["file"], wrong["result"]) == ("wrong.py", "no")
    assert said in wrong["words"]
    assert (tmp_path / "results.png").read_bytes()[:4] == b"\x89PNG"


def table(folder):
    with open(str(folder / "results.csv"), newline="") as rows:
        return list(csv.DictReader(rows))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(1, SEEDS + 1))
@pytest.mark.parametrize("name", EXERCISES)
def test_the_reference_solutions_pass(name, seed, tmp_path):
    done = exercise(name, solved(name, tmp_path), "--seed", seed)
    assert done.returncode == 0, done.stdout


@pytest.mark.long
def test_a_class_of_wrong_programs_and_a_right_one_behind_each_hostile_one(tmp_path):
    for name, (text, _) in WRONG.items():
        (tmp_path / f"{name}.py").write_text(text)
    right = solved("distance", tmp_path).read_text()
    for name in ("floods", "leaves_children", "takes_its_name", "eats_memory"):
        (tmp_path / f"{name}_then_right.py").write_text(right)
    subprocess.run([*EXERCISE, "distance", "--class", str(tmp_path)], stdin=subprocess.DEVNULL, check=True)
    rows = {row["file"][:-3]: row for row in table(tmp_path)}
    wrong = {name: rows[name] for name, (_, said) in WRONG.items()
             if rows[name]["result"] != "no" or said not in rows[name]["words"]}
    assert not wrong
    assert {rows[name]["result"] for name in rows if name not in WRONG} == {"passed"}

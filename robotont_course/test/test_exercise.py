"""./robotont exercise: a student's program in the simulator."""

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from robotont_course.exercise import parse, show_list, show_task
from robotont_course.exercises import EXERCISES

PACKAGE = Path(__file__).resolve().parents[1]
TEMPLATES, SOLUTIONS = PACKAGE / "exercises", PACKAGE / "test" / "solutions"
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
    "another_topic": (HEAD.replace("cmd_vel", "cmd_val") + "twist.linear.x = 0.2\n" + LOOP, "published nothing"),
    "two_nodes": ("import os\nwho = os.fork()\n" + HEAD.replace("'mine'", "'mine' if who else 'other'")
                  + "twist.linear.x = 0.1\n" + LOOP, "2 nodes publish on cmd_vel"),
    "floods": (HEAD + "twist.linear.x = 0.1\nwhile not rospy.is_shutdown():\n    publisher.publish(twist)\n",
               "commands a second"),
    "prints": ("while True:\n    print('x' * 1000)\n", "published nothing"),
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
             "    rospy.sleep(0.01)\n", "published nothing"),
    "takes_its_name": ("import rospy\nrospy.init_node('simulator_node')\nrospy.spin()\n", "published nothing"),
    "stops_too_far": (HEAD + "twist.linear.x = 0.2\nfor _ in range(20):\n    publisher.publish(twist)\n"
                      "    rospy.sleep(0.1)\n", "from the wall, 0.55 to 0.65 m wanted"),
}


def solved(name, folder):
    """The template with the reference solution at its marked place: a file."""
    text = re.sub("(# ---- your code ----\n).*?(# ---- end)", lambda found: found[1] + "\n"
                  + (SOLUTIONS / f"{name}.py").read_text() + found[2], (TEMPLATES / f"{name}.py").read_text(),
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


@pytest.mark.parametrize("name", EXERCISES)
def test_every_exercise_has_a_task_and_a_template_with_one_marked_place(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    show_task(name)
    assert f"./robotont exercise {name} {name}.py" in capsys.readouterr().out
    text = (tmp_path / f"{name}.py").read_text()
    assert text.count("# ---- your code") == text.count("# ---- end of your code") == 1
    assert f"within {EXERCISES[name].limit:g} s" in re.sub(r"\s+", " ", (TEMPLATES / f"{name}.md").read_text())
    compile(solved(name, tmp_path).read_text(), name, "exec")


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

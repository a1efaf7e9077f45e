"""A student's program in its exercise: judged by where the robot truly was, in words, with a picture.

Without a FILE it shows the task, and puts the template NAME.py into this folder. Exit status 0: passed, or --class;
1: not; 2: the exercise could not be run.
"""

import argparse
import csv
import pickle
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import rospkg

from robotont_course import judge
from robotont_course.exercises import EXERCISES
from robotont_driver.parameters.argument_parser import ArgumentParser

PATIENCE = 120.0  # [s] more than its time that a run may take in a class


def parse(words):
    """The options."""
    parser = ArgumentParser(prog="./robotont exercise", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("name", nargs="?", type=lambda name: dict(zip("12345678", EXERCISES)).get(name, name),
                        choices=EXERCISES, metavar="NAME", help=", ".join(EXERCISES) + "; or 1 to 8; without: a list")
    parser.add_argument("file", nargs="?", type=Path, metavar="FILE", help="the program; without: the task")
    parser.add_argument("--class", dest="folder", type=Path, metavar="FOLDER",
                        help="judge each .py of a folder; writes results.csv and results.png there")
    parser.add_argument("--seed", type=int, default=0, help="another start for each number [0: as in the world's file]")
    parser.add_argument("--result", type=Path, help=argparse.SUPPRESS)  # of a run in a class
    options = parser.parse_args(words)
    if not options.name and words:
        parser.error("found no NAME, allowed: " + ", ".join(EXERCISES))
    if options.file and not (options.file.is_file() and options.file.suffix == ".py"):
        parser.error(f"FILE: found {str(options.file)!r}, allowed: a program, a file NAME.py that is there")
    if options.seed < 0:
        parser.error(f"--seed: found {options.seed}, allowed: 0 and more")
    if options.folder and not programs(options.folder):
        parser.error(f"found no programs, *.py, in {options.folder}")
    return options


def programs(folder):
    """The programs of a class, files (Path)."""
    return sorted(file for file in folder.glob("*.py") if file.is_file())


def texts(name):
    """(the task, the template) of an exercise."""
    folder = Path(rospkg.RosPack().get_path("robotont_course")) / "exercises"
    task, template = ((folder / file).read_text() for file in (f"{name}.md", "template.py"))
    title, known = task.partition("\n")[0].strip("# "), re.search("You know `(.*?)`", task)
    return task, template.replace("TITLE", title).replace("KNOWN", known[1])


def show_list():
    """Print each exercise's name and what it asks for."""
    for place, name in enumerate(EXERCISES, 1):
        print(f"{place}  {name:10} {texts(name)[0].splitlines()[0].partition(': ')[2]}")
    print("a task: ./robotont exercise NAME; your program: ./robotont exercise NAME FILE")


def show_task(name):
    """Print the task, and write its template."""
    task, template = texts(name)
    file = Path(f"{name}.py")
    print(task)
    if file.exists():
        print(f"{file} is there already")
    else:
        file.write_text(template)
        print(f"your file: {file}")
    print(f"try it: ./robotont exercise {name} {file}")


def words_of(run, faults):
    """A line for each fault, or for what was passed."""
    return [f"at {second:.1f} s: {words}" for second, words in faults] or [
        f"passed in {run.end:.1f} s, {judge.way(run):.2f} m"]


def run_file(options):
    """Judge one program; the exit status."""
    from robotont_course import picture, stage  # here: a task is shown without a second of imports

    exercise = EXERCISES[options.name]
    print(f"{options.file} in the exercise {options.name}, at most {exercise.limit:g} s", flush=True)
    try:
        run, program, printed = stage.perform(exercise, options.file, options.seed)
    except stage.StackError as error:
        print(f"the exercise could not be run: {error}", file=sys.stderr)
        return 2
    faults = judge.faults(exercise, run, program)
    if faults and printed.strip():
        print("the program's last words:\n  " + "\n  ".join(printed.strip().splitlines()[-15:]))
    words, target = words_of(run, faults), options.file.with_suffix(".png")
    print("\n".join(words))
    picture.draw_class([(run, faults, f"{options.file.name}: " + "; ".join(words))], target, 6.4)
    print(f"picture: {target}")
    if options.result:
        options.result.write_bytes(pickle.dumps((run, faults)))
    return 1 if faults else 0


def run_apart(options, file):
    """(`judge.Run` or None, faults) of a program of a class, judged in a process of its own; its picture is kept."""
    with tempfile.TemporaryDirectory() as folder:
        # a copy in a folder of its own: one that is called math.py or rospy.py would be every other's module
        result, program = Path(folder) / "result", Path(folder) / file.name
        try:
            shutil.copy(str(file), folder)
            done = subprocess.run(
                [sys.executable, sys.argv[0], options.name, str(program), "--seed", str(options.seed), "--result",
                 str(result)], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                check=False, timeout=EXERCISES[options.name].limit + PATIENCE)
            if program.with_suffix(".png").exists():
                shutil.copy(str(program.with_suffix(".png")), str(file.parent))
            return pickle.loads(result.read_bytes()) if result.exists() else (
                None, [(0.0, "not judged: " + done.stderr.strip()[-300:])])
        except (OSError, subprocess.TimeoutExpired) as error:
            return None, [(0.0, f"not judged: {getattr(error, 'strerror', 'its run did not end')}")]


def run_class(options):
    """Judge the programs of a folder one after the other; the exit status."""
    from robotont_course import picture

    rows = [["exercise", "file", "result", "seconds", "way [m]", "touched at [s]", "stands at the end", "words"]]
    drawn = []
    files = programs(options.folder)
    for number, file in enumerate(files, 1):
        print(f"{number} of {len(files)}: {file.name}", flush=True)
        run, faults = run_apart(options, file)
        touched, verdict = run and judge.touch(run), "no" if faults else "passed"
        rows.append([options.name, file.name, verdict, f"{run.end if run else 0:.1f}",
                     f"{judge.way(run) if run else 0:.2f}",
                     f"{touched[0]:.1f}" if touched else "", "yes" if run and judge.stands_for(run) > 0.5 else "no",
                     "; ".join(words_of(run, faults)) if faults else ""])
        drawn.append((run, faults, f"{file.name}: {verdict}" + ("" if faults else f", {run.end:.1f} s")))
        print(f"{file.name:30} {verdict:7} {rows[-1][-1]}", flush=True)
    with open(str(options.folder / "results.csv"), "w", newline="", encoding="utf-8",
              errors="backslashreplace") as table:
        csv.writer(table).writerows(rows)
    picture.draw_class(drawn, options.folder / "results.png")
    print(f"{options.folder / 'results.csv'}, {options.folder / 'results.png'}")
    return 0


def main():
    """Run the command; returns the exit status."""
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(errors="backslashreplace")  # names of files in whatever encoding
    options = parse(sys.argv[1:])
    try:
        if options.folder:
            return run_class(options)
        if options.file:
            return run_file(options)
        if options.name:
            show_task(options.name)
        else:
            show_list()
    except OSError as error:
        print(f"exercise: {error.filename}: {error.strerror}: is there room, and may you write there?", file=sys.stderr)
        return 2
    return 0

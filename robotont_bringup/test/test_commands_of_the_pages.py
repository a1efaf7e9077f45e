"""Each command of README, of Learn and Do, and of calibration is run by a test, or says here what it needs."""

import re
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
NAV = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
PAGES = ["README.md", "docs/odometry.md", *(
    f"docs/{name}" for entry in NAV for kind, pages in entry.items() if kind in ("Learn", "Do")
    for page in pages for name in page.values())]
PROGRAMS = ("./robotont", "roslaunch", "rosrun", "rosnode", "rosbag", "rostopic", "rosservice", "rosparam", "python3",
            "git", "catkin_make", "sudo", "openssl", "ssh", "wsl", "journalctl")
HARDWARE, OTHERS = "needs hardware", "needs another's program or rights of root: "
# What runs a command: a file of tests, which names it by the word behind the colon, or why none does.
RUN_BY = {
    "./robotont": "robotont_bringup/test/test_robotont_script.py: COMMANDS",
    "./robotont --version": "robotont_bringup/test/test_robotont_script.py: --version",
    "./robotont COMMAND": "robotont_bringup/test/test_robotont_script.py: -h",
    "./robotont demo": "robotont_bringup/test/test_nothing_is_left_running.py: demo",
    "./robotont exercise": "robotont_course/test/test_exercise.py: exercise",
    "./robotont fleet": "robotont_fleet/test/fleet_rig.py: fleet",
    "./robotont flash": "robotont_firmware/test/test_firmware_flash.py: flash",
    "./robotont install-robot": "robotont_operations/test/test_install_robot.py: install_robot",
    "./robotont keys": "robotont_teleop/test/terminal.py: keyboard_teleop",
    "./robotont network": "robotont_operations/test/test_network.py: network",
    "./robotont release": "robotont_bringup/test/test_robotont_script.py: release",
    "./robotont report": "robotont_operations/test/test_report.py: report",
    "./robotont rviz": "robotont_bringup/test/rostest_rviz.py: rviz",
    "./robotont setup": "robotont_bringup/test/test_robotont_script.py: setup",
    "./robotont shell": "robotont_bringup/test/test_robotont_script.py: shell",
    "./robotont sim": "robotont_bringup/test/test_nothing_is_left_running.py: sim",
    "./robotont status": "robotont_operations/test/rostest_status.py: status",
    "./robotont test": ".ci/tests.bash: run_tests",
    "./robotont update": "robotont_bringup/test/test_robotont_script.py: update",
    "./robotont wheels": "robotont_calibration/test/test_turned_wheels.py: turned_wheels",
    "./robotont which": "robotont_driver/test/test_which_robot.py: which",
    "python3 examples/plot_bag.py": "robotont_demo/test/test_examples.py: plot_bag",
    "python3 distance.py": "robotont_course/test/test_exercise.py: exercise",
    "python3 examples/square.py": "robotont_demo/test/test_examples.py: square",
    "python3 my_square.py": "robotont_demo/test/test_examples.py: square",  # its copy
    "rosrun calibrate_wheels": "robotont_calibration/test/test_calibrate_wheels.py: calibrate_wheels",
    "rosrun goto": "robotont_map_navigation/test/rostest_goto.py: goto",
    "rosrun install_robot": "robotont_operations/test/test_install_robot.py: install_robot",
    "rosrun keyboard_teleop": "robotont_teleop/test/terminal.py: keyboard_teleop",
    "rosrun map_saver": OTHERS + "map_server",
    "rosrun odometry_report": "robotont_calibration/test/test_odometry_report.py: odometry_report",
    "rosrun relocalize": "robotont_map_navigation/test/fault_run.py: relocalize",
    "rosrun robot": "robotont_bringup/test/test_commands_of_the_pages.py: robot",
    "roslaunch display.launch": "robotont_bringup/test/rostest_rviz.py: display.launch",
    "roslaunch fleet.launch": "robotont_operations/test/test_install_robot.py: fleet.launch",
    "roslaunch gamepad.launch": "robotont_teleop/test/test_hands_through_the_mux.py: gamepad:=true",
    "roslaunch navigation.launch": "robotont_map_navigation/test/test_navigation_launch.py: navigation.launch",
    "roslaunch robot.launch": "robotont_bringup/test/rostest_stack.py: robot.launch",
    "roslaunch rs_camera.launch": HARDWARE,
    "roslaunch scan_to_distance.launch": "robotont_course/test/rostest_robotont_msgs.py: scan_to_distance",
    "roslaunch slam.launch": "robotont_map_navigation/test/test_navigation_launch.py: slam.launch",
    "roslaunch teleop.launch": "robotont_teleop/test/test_hands_through_the_mux.py: teleop.launch",
    "catkin_make": OTHERS + "a workspace of catkin_make, minutes",
    "rosrun my_square.py": OTHERS + "a workspace of catkin_make", "roslaunch my.launch": OTHERS + "the same",
    "git clone": OTHERS + "the network", "git stash": OTHERS + "git",
    "git push": "robotont_bringup/test/test_robotont_script.py: push",
    "journalctl": OTHERS + "systemd", "ssh": OTHERS + "a second machine",
    "rosbag": OTHERS + "rosbag", "rosnode": OTHERS + "rosnode", "rostopic": OTHERS + "rostopic",
    "sudo": OTHERS + "apt, systemd", "wsl": OTHERS + "Windows",
}


def commands(text):
    """The commands of a page: lines of its blocks, and what stands between backquotes, without comments."""
    text = re.sub(r"\\\n\s*", " ", text)
    for line in [*re.findall(r"^ {4,}(\S.*)$", text, re.MULTILINE), *re.findall(r"`([^`\n]+)`", text)]:
        for part in re.split(r"&&|;|'|\bdo\b", re.sub(r"\s+#.*", "", line)):
            words = re.sub(r"^\s*([A-Z_]+=\S+\s+|sudo (?=\./))*", "", part).split()
            if words and words[0] in PROGRAMS:
                yield words


FOUND = {page: sorted({" ".join(words) for words in commands((ROOT / page).read_text(encoding="utf-8"))})
         for page in PAGES}


def kind(words):
    """The key of a command in RUN_BY."""
    first, rest = words[0], [word for word in words[1:] if word not in ("-t",)]
    if first == "rosrun":
        return f"rosrun {rest[1]}" if len(rest) > 1 else "rosrun"
    if first == "roslaunch":
        return next((f"roslaunch {word}" for word in rest if word.endswith(".launch")), "")
    if first in ("./robotont", "python3", "git"):
        return " ".join([first, *rest[:1]]) if rest and rest[0] != "-h" else first
    return first


def why_not(command):
    """Why a command of a page is not held, or nothing."""
    words = command.split()
    key = kind(words)
    if not key or words == ["python3"]:  # a word of a sentence
        return ""
    if key not in RUN_BY:
        return f"'{command}': which test runs it, or what does it need?"
    if not RUN_BY[key].startswith((HARDWARE, OTHERS)):
        file, word = RUN_BY[key].split(": ")
        if word not in (ROOT / file).read_text(encoding="utf-8"):
            return f"{file} does not run {key}"
    if words[:1] == ["rosrun"] and words[1].startswith("robotont_"):
        return "" if (ROOT / words[1] / "scripts" / words[2]).exists() else f"no program for '{command}'"
    if words[:1] == ["roslaunch"] and words[1].startswith("robotont_"):
        folder = "launch" if words[1] == "robotont_bringup" else f"{words[1]}/launch"
        files = [ROOT / folder / words[2]] + [ROOT / "launch" / "simulation.launch"] * ("sim:=true" in words)
        known = {one.get("name") for file in files for one in ElementTree.parse(str(file)).getroot().findall("arg")}
        known |= {"imu"} if len(files) > 1 else set()  # simulation.launch passes it on
        unknown = {word.split(":=")[0] for word in words if ":=" in word} - known
        return f"'{command}': no argument {unknown}" if unknown else ""
    return ""


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_of_a_page(page):
    assert [why for why in map(why_not, FOUND[page]) if why] == []


def test_pages_and_sections_that_messages_and_comments_name_exist():
    kinds = (".py", ".yaml", ".launch", ".xacro", ".bash", ".txt", ".js", ".conf", "")
    files = [path for folder in ("robotont_*", "config", "launch", "setup", "examples")
             for path in ROOT.glob(f"{folder}/**/*")
             if path.suffix in kinds and path.is_file() and "__pycache__" not in path.parts]
    wrong = set()
    for path in [*files, ROOT / "robotont", ROOT / "conftest.py"]:
        text = path.read_text(encoding="utf-8", errors="ignore")
        for page, section in re.findall(r'docs/([\w-]+\.md)(?:, \\?"([^"\\]+))?', text):
            file = ROOT / "docs" / page
            if not file.exists() or (section and f"# {section}\n" not in file.read_text(encoding="utf-8")):
                wrong.add((str(path.relative_to(ROOT)), page, section))
    assert not wrong


def without_programs_of_others(text):
    """A page without the table of the makers' programs."""
    ours, _, section = text.partition("\n## From the official stack\n")
    return "\n".join([ours, *(line for line in section.split("\n") if not line.startswith("|"))])


def test_files_and_tests_that_pages_name_exist():
    folders = ("robotont_*", "config", "launch", "setup", "examples", "benchmarks", "docs")
    paths = [path for folder in folders for path in ROOT.glob(f"{folder}/**/*") if path.is_file()]
    there = {path.name for path in [*paths, *ROOT.glob("*")]} | {
        name for path in paths if path.suffix == ".py" and "test" in path.name
        for name in re.findall(r"def (test_\w+)", path.read_text(encoding="utf-8"))}
    theirs = {"rs_camera.launch", "foxglove_bridge.launch", "robotont_bringup.launch",  # of others
              "my_room.yaml", "my_square.py", "my.launch", "notes.txt", "runs.txt",  # made later
              "robotont_fleet_stops_8110.json", "pin_profile_NAME.py", "setup.bash"}
    a_name = re.compile(r"[\w./-]+\.(?:py|test|launch|js|yaml|xacro|html|css|bash|txt|json)\b|\btest_\w+")
    named = {(path.name, name.rpartition("/")[2])
             for path in [*ROOT.glob("docs/*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
             for words in re.findall(r"`([^`\n]+)`", without_programs_of_others(path.read_text(encoding="utf-8")))
             for name in a_name.findall(words)}
    assert {one for one in named if one[1] not in there | theirs and one[1] + ".py" not in there} == set()


def test_nothing_in_the_list_that_no_page_names():
    assert set(RUN_BY) - {kind(command.split()) for found in FOUND.values() for command in found} == set()


def check(folder):
    """Run rosrun robotont_bringup robot FOLDER."""
    return subprocess.run([str(ROOT / "robotont_bringup" / "scripts" / "robot"), str(folder)], check=False, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def test_robot_lists_the_mistakes_of_a_folder(tmp_path):
    folder = tmp_path / "mine"
    shutil.copytree(str(ROOT / "config" / "robots" / "four_wheels"), str(folder))
    assert check(folder).returncode == 0
    file = folder / "wheel_params.yaml"
    file.write_text(file.read_text().replace("wheelAmount: 4", "wheelAmount: 5") + "\nwheelRadios: 1\n")
    wrong = check(folder)
    assert wrong.returncode != 0
    assert "wheelRadios" in wrong.stdout
    assert "wheelRads" in wrong.stdout

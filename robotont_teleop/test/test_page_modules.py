"""The page's modules that know no browser, by `node --test`, where node is there; every fault key has its sentence."""

import json
import re
import shutil
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest

from robotont_driver.nodes.odom_node import fault_of_wheels
from robotont_driver.protocol.connection import Listener
from robotont_driver.protocol.official_boards import OLD
from robotont_teleop.hand.fault_keys import FAULTS, fault_key

HERE = Path(__file__).resolve().parent
WEB = HERE.parent / "web"


@pytest.mark.skipif(not shutil.which("node"), reason="no node: the modules of page/modules.test.mjs are not tested")
def test_modules(tmp_path):
    for folder in (WEB, HERE / "page"):
        shutil.copytree(folder, tmp_path / folder.relative_to(HERE.parent))
    (tmp_path / "package.json").write_text('{"type": "module"}')
    result = subprocess.run(["node", "--test", "test/page/modules.test.mjs"], cwd=tmp_path, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    assert result.returncode == 0, result.stdout


def test_each_fault_key_has_a_sentence_and_the_page_knows_those_that_bar_it():
    sentences = {key[6:] for key in texts() if key.startswith("fault_")}
    assert sentences == {key for key, _, _ in FAULTS} | {"silent"}
    listed = re.search(r"const IMMOVABLE = \[(.*?)\]", (WEB / "truth.js").read_text(), re.DOTALL)[1]
    assert set(re.findall(r'"(\w+)"', listed)) <= {key for key, _, _ in FAULTS}


def texts():
    """Those of all pages: {key: {language: words}}."""
    return {key: words for path in HERE.parents[1].glob("*/web/*texts.json")
            for key, words in json.loads(path.read_text()).items()}


def test_each_text_has_three_languages_with_the_same_gaps():
    for key, words in texts().items():
        assert list(words) == ["en", "de", "et"], key
        assert all(words.values()), key
        assert len({one.count("{}") for one in words.values()}) == 1, key


def test_each_key_that_a_page_names_has_its_texts():
    named = [pair for folder in HERE.parents[1].glob("*/web") for path in folder.iterdir()
             if path.suffix in (".js", ".html")
             for pair in re.findall(r'data-(?:text|label)="(\w+)"|\btext\("(\w+)"', path.read_text())]
    assert len(named) >= 59
    assert {key for pair in named for key in pair if key} <= set(texts())


@pytest.mark.parametrize("task, words, key", [
    ("robot1/serial_com_node: link", "/dev/ttyACM0: no packet for 5 s; is the board plugged in?", "board_silent"),
    ("serial_com_node: link", Listener().heard, "board_silent"),
    ("serial_com_node: link", "lines come, but of no known protocol: 'hello'; is it the right port, and does the board "
     "run firmware of Robotont?", "board_unknown"),
    ("serial_com_node: board", OLD, "board_unknown"),
    ("serial_com_node: board", "the battery is low at 9.9 V: charge it", "battery_low"),
    ("serial_com_node: link", "60 packets come per second instead of 50 (pidControlFrequency)", "wrong_rate"),
    ("serial_com_node: board", "wheel 0: no counts although it is driven: encoder unplugged; no motor drives until "
     "a command of zeros / the battery is low: charge it", "board_fault"),
    ("serial_com_node: board", "the board waits for a command of zeros: it has restarted",
     ""),
    ("serial_com_node: link", "5 messages on serial_write were no packets", ""),
    ("odom_node: wheel feedback", "no packets on serial_read, the odometry stands still: see the diagnostics of the "
     "link", "board_silent"),
    ("cmd_vel_mux: guard", "cannot be used: no robot's wheels on the parameter server: does not interfere", ""),
    ("cmd_vel_mux: guard", "scan of 'laser' by /scanner cannot be used: no odometry within 2 s of its stamps",
     "guard_blind"),
    ("navigation_monitor: localization", "the map explains 50% of the scan's rays, the others end before its walls: "
     "something that the map lacks fills the view", ""),
    ("odom_node: stamps", "the clock was set forward by 3 s", "")])
def test_a_fault_has_the_key_of_its_own_words_and_not_of_its_task(task, words, key):
    assert fault_key(task, words) == key


@pytest.mark.parametrize("found, key", [
    ({"slipping": [1]}, "wheel_slips"), ({"alike": [0, 2]}, "wheel_slips"), ({"lagging": [1]}, "wheel_blocked"),
    ({"alike": [3]}, ""), ({"alike": [0, 3]}, "")])
def test_a_wheel_that_slips_is_not_called_blocked_nor_a_push_either(found, key):
    search = SimpleNamespace(**{"wheels": 3, "slipping": (), "alike": (), "lagging": (), **found})
    assert fault_key("odom_node: wheel feedback", fault_of_wheels(search)) == key

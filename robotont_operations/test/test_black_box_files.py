"""The black box on files: what it keeps, what it deletes, and what a loss of power leaves of it."""

import contextlib
import os
import shutil
import subprocess
from unittest import mock

import pytest
import rosbag
from geometry_msgs.msg import Twist
from std_msgs.msg import String

from robotont_driver.ros.diagnostics import ERROR, OK, WARN
from robotont_operations import black_box_files, recorder_node
from robotont_operations.black_box_files import MOST_RUNS, BlackBox, Record, bags_of, merge, runs_in

pytestmark = pytest.mark.skipif(not rosbag.bag.found_lz4, reason="no roslz4, which is compiled, for this Python")
HEADER = {"type": String._type, "md5sum": String._md5sum, "message_definition": String._full_text}


def record(second, text="0:0:0;\n"):
    data = text.encode()
    return Record("/serial_read", 1000.0 + second, len(data).to_bytes(4, "little") + data, HEADER)


def fill(box, seconds, records=lambda second: [record(second)]):
    for second in range(seconds):
        box.write(records(second), now=float(second))


def messages(bags):
    found = []
    for path in bags:
        with rosbag.Bag(str(path)) as bag:
            found += [(topic, message.data, stamp.to_sec()) for topic, message, stamp in bag.read_messages()]
    return found


def test_each_file_opens_and_the_oldest_go(tmp_path):
    box = BlackBox(tmp_path, keep=60.0)
    fill(box, 100, lambda second: [record(second, f"{second};"), record(second + 0.5, f"{second}.5;")])
    bags = bags_of(box.folder)
    assert len(bags) == 61
    assert messages(bags)[0] == ("/serial_read", "39;", 1039.0)
    assert messages(bags)[-1] == ("/serial_read", "99.5;", 1099.5)


def test_the_disk_is_bounded(tmp_path, monkeypatch):
    monkeypatch.setattr(black_box_files, "RUN_SIZE", 500_000)
    box = BlackBox(tmp_path, keep=1e9)
    fill(box, 60, lambda second: [record(second, os.urandom(25_000).hex())])
    size = sum(path.stat().st_size for path in tmp_path.rglob("*") if path.is_file())
    assert 400_000 < size <= 500_000 + 60_000
    assert messages(bags_of(box.folder))[-1][2] == 1059.0


@pytest.mark.parametrize("size, kept", [(0, 3), (10 ** 9, MOST_RUNS)], ids=["long", "short"])
def test_a_restart_keeps_what_led_to_it(size, kept, tmp_path, monkeypatch):
    """Full runs as long as there is room; short ones, of a robot that is switched on and off, push nothing out."""
    for run in range(60 if size else 6):
        box = BlackBox(tmp_path)
        box.write([record(run, f"run {run}")], now=0.0)
        run_size = sum(path.stat().st_size for path in bags_of(box.folder))
        monkeypatch.setattr(black_box_files, "RUN_SIZE", 2 * run_size)
        monkeypatch.setattr(black_box_files, "SIZE", size or 4 * run_size)
    found = [messages(bags_of(one))[0][1] for one in runs_in(tmp_path)]
    assert found == [f"run {number}" for number in range(run + 1 - kept, run + 1)]


def test_a_file_that_cannot_be_read_costs_nothing_but_itself(tmp_path):
    box = BlackBox(tmp_path)
    fill(box, 3)
    middle = bags_of(box.folder)[1]
    for content in (os.urandom(5000), b"#ROSBAG V2.0\n" + b"\xff" * 5000, b"", middle.read_bytes()[:-100]):
        middle.write_bytes(content)
        count, (words,) = merge(bags_of(box.folder), tmp_path / "all.bag",
                                lambda _topic, raw: raw[-1]().deserialize(raw[1]))
        assert count == 2
        assert f"{box.folder.name}/000002.bag: " in words
    box.write([record(3), record(3)._replace(data=b"abc"), record(4)], now=3.0)
    count, words = merge(bags_of(box.folder), tmp_path / "all.bag", lambda _topic, raw: raw[-1]().deserialize(raw[1]))
    assert (count, words[1:]) == (4, [f"{box.folder.name}/000004.bag: 1 messages"])


def test_a_record_of_an_unknown_or_a_second_type_costs_nothing_but_itself(tmp_path):
    def said(topic, header, data=b"\1\0\0\0x"):
        return Record(topic, 1000.0, data, header)
    bare = {key: HEADER[key] for key in ("type", "md5sum")}
    twist = {"type": Twist._type, "md5sum": Twist._md5sum, "message_definition": Twist._full_text}
    box = BlackBox(tmp_path)
    assert box.write([said("/b", bare), said("/b", HEADER), record(0), said("/b", twist, bytes(48)), said("/b", HEADER),
                      said("/c", bare)], now=0.0) == 3
    assert [topic for topic, *_ in messages(bags_of(box.folder))] == ["/b", "/b", "/serial_read"]
    assert box.write([], now=1.0) == 0


def test_the_newest_run_is_the_last_beside_one_that_somebody_has_copied(tmp_path):
    for name in ("run_000041_2026", "run_9_kept", "run_1000000_2026"):
        (tmp_path / name).mkdir()
    runs = [BlackBox(tmp_path).folder for _ in range(2)]
    assert runs_in(tmp_path)[-2:] == runs


def test_a_run_that_this_user_may_not_enter_does_not_keep_the_recorder_from_its_own(tmp_path, monkeypatch):
    run, stat = BlackBox(tmp_path).folder, os.stat
    (run / "000001.bag").touch()

    def denied(path, *given, **options):
        if str(path).endswith(".bag"):
            raise PermissionError(13, "Permission denied")
        return stat(path, *given, **options)
    monkeypatch.setattr(os, "stat", denied)
    assert BlackBox(tmp_path).folder == runs_in(tmp_path)[1] != run


def test_what_is_no_run_of_the_recorder_stays_alone(tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/kept").touch()
    (tmp_path / "run_000000_link").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "run_000001_file").touch()
    (tmp_path / "run_\u00b2_x").mkdir()
    (tmp_path / "run_000002_gone").symlink_to(tmp_path / "nowhere")
    monkeypatch.setattr(black_box_files, "MOST_RUNS", 2)
    runs = [BlackBox(tmp_path).folder for _ in range(4)]
    assert runs_in(tmp_path) == runs[2:]
    os.mkfifo(str(runs[3] / "000001.bag"))
    assert bags_of(runs[3]) == []
    assert sorted(path.name for path in tmp_path.iterdir() if path not in runs) == [
        "elsewhere", "run_000000_link", "run_000001_file", "run_000002_gone", "run_\u00b2_x"]
    assert (tmp_path / "elsewhere/kept").exists()


def test_a_full_disk_makes_room_and_says_so(tmp_path, monkeypatch):
    box = BlackBox(tmp_path)
    fill(box, 3)
    with monkeypatch.context() as full:
        full.setattr(os, "fsync", lambda _: (_ for _ in ()).throw(OSError(28, "No space left on device")))
        with pytest.raises(OSError, match="No space"):
            box.write([record(3)], now=3.0)
    assert len(list(box.folder.iterdir())) == 2
    box.write([record(4)], now=4.0)
    assert len(messages(bags_of(box.folder))) == 3


def test_the_recorder_tells_what_it_could_not_write_and_makes_a_folder_again_that_was_deleted(tmp_path):
    """It keeps the newest file alone, and finds the one before deleted, too."""
    folder = tmp_path / "black_box"
    with mock.patch.multiple(recorder_node, rospy=mock.Mock(), RepeatingThread=mock.Mock(), Health=mock.Mock()):
        node = recorder_node.RecorderNode({"folder": folder, "topics": "serial_read", "keep": 0.0})
        recorder_node.rospy.on_shutdown.assert_called_once_with(node._write)

        def written(one):
            node._records = [one]
            assert 0.0 <= node._work() <= 1.0
            return node._report()[:2]
        assert written(record(0)) == (OK, "recording")
        node._records = [record(2)]
        assert node._report()[:2] == (WARN, "nothing is written since 10 s: the disk hangs, or is too slow")
        run, = runs_in(folder)
        shutil.rmtree(str(folder))
        folder.write_text("no folder")
        level, words = written(record(2))
        assert (level, words.startswith(f"cannot write to {run}: ")) == (ERROR, True)
        folder.unlink()
        level, words = written(record(3))
        assert (level, words.startswith("1 messages lost, the newest: cannot write to")) == (WARN, True)
        assert [stamp for _, _, stamp in messages(bags_of(run))] == [1003.0]


@contextlib.contextmanager
def mounted(disk, folder):
    """A block in which the image of a disk is mounted."""
    done = subprocess.run(["mount", "-o", "loop", str(disk), str(folder)], check=False, capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"no loop device here: {done.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def test_what_a_loss_of_power_leaves(tmp_path):
    """On a disk of its own, whose image is copied as it is, with whatever the kernel has not written yet missing."""
    if os.getuid() != 0:
        pytest.skip("needs root to mount a disk image")
    disk, after, folder = tmp_path / "disk", tmp_path / "after", tmp_path / "mounted"
    folder.mkdir()
    with open(disk, "wb") as file:
        file.truncate(32_000_000)
    subprocess.run(["mkfs.ext4", "-q", str(disk)], check=True)
    with mounted(disk, folder):
        box = BlackBox(folder)
        fill(box, 20, lambda second: [record(second + part / 100) for part in range(100)])
        (folder / "not_flushed").write_bytes(b"x" * 1000)
        shutil.copy(disk, after)  # the power is lost here
    with mounted(after, folder):
        assert not (folder / "not_flushed").exists() or not (folder / "not_flushed").read_bytes()
        run = runs_in(folder)[-1]
        assert len(messages(bags_of(run))) == 2000
        subprocess.run(["rosbag", "info", *map(str, bags_of(run))], check=True, stdout=subprocess.DEVNULL)

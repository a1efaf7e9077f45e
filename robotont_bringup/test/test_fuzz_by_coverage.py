"""Every parser against bytes that are made to reach all of its code: results, or the documented errors."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

from robotont_testing.places import config
from robotont_testing.robots import WHEEL_PARAMS

SCRIPT = Path(__file__).with_name("fuzz_by_coverage.py")
RUNS = 100_000
LINES = [b"-18:0:18;\n", b"-18:0:18;07:0012:FFEE:0012:000000000:1C8B\n", b"# robotont_firmware 2.0.0 wheels 3\n",
         b"ODOM:0.100000:-0.200000:0.300000:0.010000:0.000000:0.500000\r\n", b"RANGE:1:2:3:4:5:6:7:8:9:10:11:12\r\n",
         b"POWER:0.5:14.8\r\n", b"Setpoints 1:2:3\r\nEncoders 1:2:3\r\n\r\n"]
YAML = [path.read_bytes() for path in (WHEEL_PARAMS, *config(".").glob("*.yaml"), *config("worlds").glob("*.yaml"))]
CSV = [b"time,wheel_0,wheel_1,wheel_2,x,y,yaw\n0.02,1,2,-3,0.1,0.2,0.3\n" * 3, b"0.5,0.1,0.2,0.3,1,2,3\n" * 5]
SEEDS = {"packet": LINES, "parameters": YAML, "wheel_file": YAML, "world": YAML, "csv": CSV, "optiodom": CSV,
         **dict.fromkeys(("auto", "plain", "checked", "robotont2", "robotont3", "robotont2018"), LINES)}

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(importlib.util.find_spec("atheris") is None, reason="no atheris: .build/tools/bin/python -m pip "
                       "install -r setup/pypi/fuzzing.txt (CPython 3.11 and newer, x86-64)")]


@pytest.mark.parametrize("parser", SEEDS)
def test_nothing_but_documented_errors(parser, tmp_path):
    seeds = tmp_path / "seeds"
    seeds.mkdir()
    for number, seed in enumerate(SEEDS[parser]):
        (seeds / str(number)).write_bytes(seed)
    done = subprocess.run(
        [sys.executable, str(SCRIPT), parser, str(seeds), f"-runs={RUNS}", "-max_len=2000", "-seed=1"],
        check=False, cwd=str(tmp_path), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert done.returncode == 0, done.stdout[-5000:]
    assert f"Done {RUNS} runs" in done.stdout, done.stdout[-2000:]
    print(done.stdout.splitlines()[-1], done.stdout.count("NEW "), "inputs that reached new code")

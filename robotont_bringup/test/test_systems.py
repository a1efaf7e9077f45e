"""Where it installs: every list of setup/pypi on every Python and machine of setup/systems.txt, by PyPI's own word."""

import itertools
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LISTS = [ROOT / "setup" / "pypi" / f"{name}.txt" for name in ("sim", "fleet", "flash", "lint", "docs", "test")]
TABLE = (ROOT / "setup" / "systems.txt").read_text()
SYSTEMS = re.findall(r"^[\w.-]+-[\d.]+ \|.*?\| (3\.\d+) \|", TABLE, re.MULTILINE)
UV = Path(sys.executable).with_name("uv")
MACHINES = ("x86_64", "aarch64")
OLDEST_LIBC = "manylinux_2_31"  # of Debian 11 and Ubuntu 20.04


def test_the_table_has_every_python():
    assert sorted(SYSTEMS, key=lambda text: int(text[2:])) == ["3.8", "3.9", "3.10", "3.11", "3.12", "3.13"]


@pytest.fixture(scope="module", name="resolutions")
def fixture_resolutions(tmp_path_factory):
    """{(Python, machine): running uv}: all at once, for they wait for PyPI."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("UV_", "PIP_"))}
    if "PIP_CERT" in os.environ:
        environment["SSL_CERT_FILE"] = os.environ["PIP_CERT"]
    # --python: else it tries every interpreter of the computer
    command = [str(UV), "pip", "compile", "--no-config", "--quiet", "--only-binary", ":all:",
               "--python", sys.executable, "--python-version", "{0}", "--python-platform", "{1}-" + OLDEST_LIBC,
               *map(str, LISTS), "-o", str(tmp_path_factory.mktemp("resolved") / "{0}-{1}.txt")]
    return {case: subprocess.Popen([word.format(*case) for word in command], env=environment, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, text=True)
            for case in itertools.product(SYSTEMS, MACHINES)}


@pytest.mark.nightly
@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("python", SYSTEMS)
def test_every_list_resolves_to_wheels(python, machine, resolutions):
    output, _ = resolutions[python, machine].communicate()
    if "Failed to fetch" in output:
        pytest.skip("PyPI cannot be reached")
    assert resolutions[python, machine].returncode == 0, output

"""Where it installs: every list of setup/pypi on every Python and machine of docs/systems.md, by PyPI's own word."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LISTS = [ROOT / "setup" / "pypi" / f"{name}.txt" for name in ("sim", "flash", "lint", "docs", "test")]
TABLE = (ROOT / "docs" / "systems.md").read_text()
SYSTEMS = re.findall(r"^\| [\w.-]+-[\d.]+ \|.*?\| (3\.\d+) \|", TABLE, re.MULTILINE)
UV = Path(sys.executable).with_name("uv")
OLDEST_LIBC = "manylinux_2_31"  # of Debian 11 and Ubuntu 20.04


def test_the_table_has_every_python():
    assert sorted(SYSTEMS, key=lambda text: int(text[2:])) == ["3.8", "3.9", "3.10", "3.11", "3.12", "3.13"]


@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
@pytest.mark.parametrize("python", SYSTEMS)
def test_every_list_resolves_to_wheels(python, machine, tmp_path):
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("UV_", "PIP_"))}
    if "PIP_CERT" in os.environ:
        environment["SSL_CERT_FILE"] = os.environ["PIP_CERT"]
    done = subprocess.run(
        [str(UV), "pip", "compile", "--no-config", "--quiet", "--only-binary", ":all:", "--python-version", python,
         "--python-platform", f"{machine}-{OLDEST_LIBC}", *map(str, LISTS), "-o", str(tmp_path / "resolved.txt")],
        check=False, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if "Failed to fetch" in done.stdout:
        pytest.skip("PyPI cannot be reached")
    assert done.returncode == 0, done.stdout

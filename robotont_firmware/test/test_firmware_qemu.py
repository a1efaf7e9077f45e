"""The suites, the limits of the configuration and the cost of a period, on an emulated Cortex-M."""

import re

import pytest
from firmware_qemu import make_rom, needs_qemu, run
from firmware_tools import PACKAGE, ROOT
from test_firmware_suites import SUITES, results

PROGRAMS = sorted((PACKAGE / "test" / "qemu").glob("*.py"))
CLOCK = 80e6  # [Hz]
PERIOD = 0.02  # [s]
CYCLES = 3.0  # [cycles] of one instruction, flash wait states included: a pessimistic assumption
BYTE_TIME = 10 / 115200  # [s]
DOCS = (ROOT / "docs" / "firmware.md").read_text(encoding="utf-8")
PACKET = len("-180:-180:-180;SS:E0E0:E1E1:E2E2:FFMMRRWWWVVVLL:CCCC\n")

pytestmark = needs_qemu


@pytest.fixture(scope="module")
def rom(tmp_path_factory):
    return make_rom(tmp_path_factory.mktemp("qemu"), PROGRAMS)


@pytest.mark.parametrize("suite", SUITES)
def test_suite_on_the_emulated_board(rom, suite):
    arguments = f"sys.argv.extend(['', '/rom/src', '/rom/golden.json', {suite!r}])"
    output = run(rom, f"{arguments}\nimport run")
    print(output)
    assert "FAIL" not in output
    expected = {test for test in results("micropython")[0] if test.startswith(suite + ".")}
    assert {line[3:] for line in output.splitlines() if line.startswith("ok ")} == expected
    values = dict(line.split(" ", 2)[1:] for line in output.splitlines() if line.startswith("value "))
    for test, value in results("micropython")[1].items():
        if test.startswith(suite + "."):
            assert values[test] == value


def test_the_heap_is_large_enough_to_load_the_firmware(rom):
    output = run(rom, "import load_on_the_board")
    print(output)
    assert "# robotont_firmware safe mode" in output
    assert re.search(r"^ok keeps \d+$", output, flags=re.MULTILINE)


def test_a_period_takes_42_percent_of_its_time_and_the_documentation_states_what_was_counted(rom):
    output = run(rom, "import count_period", count=True)
    costs = {name: int(number) for name, number in re.findall(r"^(.*) (\d+)$", output, flags=re.MULTILINE)}
    share = costs["whole period with board.py on stand-ins"] * CYCLES / CLOCK / PERIOD + PACKET * BYTE_TIME / PERIOD
    print(costs, f"{100 * share:.0f} % of the period")
    assert share <= 0.425
    assert int(re.search(r"\*\*(\d+) %\*\* of a period", DOCS).group(1)) == pytest.approx(100 * share, abs=1.5)
    assert costs["free heap"] > 20000

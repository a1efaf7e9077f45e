"""What a launch sets replaces all that earlier ones left, whatever their robots were, on one master."""

from pathlib import Path

from robots_rig import NAMES, Parameters, Rig, assert_same

from robotont_driver.robots.robot_folder import shipped
from robotont_testing.harness import Master, in_own_process

SOME = (*NAMES, "robotont2 in three", "simulated four_wheels", "driver_basic", "commands", "tuned")


def test_parameters_of_each_launch_behind_all_others_are_those_on_a_fresh_master():
    """Forward and backward, so that each stands before and behind each other one."""
    with Master() as master:
        parameters = Parameters(master)
        fresh = {name: parameters.alone(name) for name in SOME}
        parameters.load("official")
        for name in (*SOME, *reversed(SOME)):
            assert parameters.load(name) == fresh[name], name


@in_own_process
def test_a_robot_drives_behind_another_one_as_alone():
    with Master() as master:
        rig = Rig(master)

        def disturb():
            rig.join()
            rig.kill_driver()
        alone = rig.behaviour("robotont2")
        rig.behaviour("four_wheels")
        assert_same(rig.behaviour("robotont2", disturb), alone, "robotont2 behind four_wheels")


def test_the_page_about_robots_has_every_robot():
    page = (Path(__file__).resolve().parents[2] / "docs" / "robots.md").read_text()
    assert all(f"`{folder.name}`" in page for folder in shipped().iterdir())

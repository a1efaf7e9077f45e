"""The parts of a fleet alone, without network and clock."""

import json
import math
import re
from pathlib import Path

import pytest
from fleet_rig import STATE
from geometry_msgs.msg import TransformStamped
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robotont_driver.ros import link_report
from robotont_fleet import fleet_node
from robotont_fleet import zenoh_keys as keys
from robotont_fleet.free_fleet import free_fleet_text
from robotont_fleet.known_robots import Fleet, read_state
from robotont_fleet.zenoh_setup import add_users, nested, read_users, router_settings
from robotont_teleop.web.frame_chain import FrameChain
from robotont_teleop.web.metrics import GAUGES, metrics
from robotont_testing.harness import tool_module
from robotont_testing.places import launch


def said(**fields):
    return json.dumps({**STATE, "speed": None, "battery": None, **fields}).encode()


@pytest.mark.parametrize("age, words", [
    (0.0, ""), (2.0, ""), (2.1, "2.1 s old, allowed: 2 s"), (-0.1, "-0.1 s old"), (math.inf, "before the connection"),
    (math.nan, "nan s old")])
def test_a_goal_of_another_age_is_refused(age, words):
    refusal = fleet_node.refusal_of_age(age)
    assert words in refusal
    assert bool(refusal) == bool(words)


def test_a_stop_is_sent_until_every_robot_of_the_name_confirms_it():
    sent = []
    fleet = Fleet(lambda name, order: sent.append((name, order["number"])))
    for identity in "ab":
        fleet.hear_token("r1", identity, present=True)
        fleet.hear_state("r1", said(id=identity), 0.0)
    fleet.hear_token("r2", "c", present=True)
    fleet.stop()
    numbers = dict(sent)
    assert set(numbers) == {"r1", "r2"}
    fleet.hear_state("r1", said(id="a", confirmed=numbers["r1"]), 1.0)
    fleet.hear_state("r2", said(id="c", confirmed="an older one"), 1.0)
    fleet.hear_token("r2", "c", present=False)
    del sent[:]
    fleet.repeat()
    assert sent == [("r1", numbers["r1"])]  # the other one of that name has not
    fleet.hear_state("r1", said(id="b", confirmed=numbers["r1"]), 1.0)
    fleet.hear_token("r2", "d", present=True)  # started again
    del sent[:]
    fleet.repeat()
    assert sent == [("r2", numbers["r2"])]
    assert fleet.view(2.0)["stop"] == {"asked": 2, "stand": 1, "waiting": ["r2"], "gone": []}
    assert [one["id"] for one in fleet.view(2.0)["robots"]] == ["a", "b", "d"]


def test_the_longest_gone_of_too_many_robots_are_forgotten():
    fleet = Fleet(lambda *_: None)
    for number in range(400):
        fleet.hear_token(f"r{number}", "a", present=True)
        fleet.hear_state(f"r{number}", said(), number)
        fleet.hear_token(f"r{number}", "a", present=False)
    names = {one["name"] for one in fleet.view(500.0)["robots"]}
    assert len(names) == 300
    assert "r399" in names


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(st.binary(max_size=200) | st.dictionaries(st.sampled_from(sorted(STATE)), st.none() | st.text() | st.floats()
       | st.lists(st.floats() | st.text(), max_size=4)).map(lambda fields: said(**fields)))
def test_whatever_a_robot_says_the_page_gets_sound_json_or_nothing(payload):
    state = read_state(payload)
    assert state is None or json.loads(json.dumps(state, allow_nan=False)) == state
    assert state is None or state["page"] == "" or state["page"].startswith(("http://", "https://"))


def transform(parent, child, x, stamp=0):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp.secs = parent, stamp
    message.transform.translation.x, message.transform.rotation.w = x, 1.0
    return message


def test_the_chain_holds_the_robots_frames_only_with_one_stamp_and_without_the_namespace():
    base, chain = "robot1/base_link", FrameChain("robot1/")
    chain.hear([transform("robot1/base_link", "robot1/wheel", 9.0), transform("map", "robot1/odom", 1.0, stamp=5)], 0.0)
    assert chain.links(base, 0.0) == []
    chain.hear([transform("robot1/base_footprint", "robot1/base_link", 0.1, stamp=1)], 0.0, fixed=True)
    chain.hear([transform("robot1/odom", "robot1/base_footprint", 2.0, stamp=7)], 0.0)
    assert chain.pose(base, 0.5) == ("map", pytest.approx((3.1, 0.0, 0.0)))
    named = chain.named(base, 0.5)
    assert [(one.header.frame_id, one.child_frame_id) for one in named] == [
        ("base_footprint", "base_link"), ("odom", "base_footprint"), ("map", "odom")]
    assert named[0].header.stamp.secs == 7
    chain.hear([transform("robot1/base_link", "laser", 0.2)], 0.0, fixed=True)
    assert chain.pose("laser", 0.5, base) == ("base_link", pytest.approx((0.2, 0.0, 0.0)))
    assert chain.pose(base, 1.5) == ("", None)  # the odometry is silent
    chain.hear([transform("map", f"other{number}", 0.0) for number in range(600)], 1.5)
    assert chain.links("other599", 1.5) == []  # too many
    chain.hear([transform("robot1/odom", "robot1/base_footprint", 3.0)], 2.0)
    assert chain.pose(base, 2.5) == ("map", pytest.approx((4.1, 0.0, 0.0)))  # a place on the map holds on


def test_keys_are_those_of_the_bridge_and_of_rosbags_typestore():
    assert keys.ros_key(keys.BATTERY, "r1").startswith(b"sensor_msgs/BatteryState".hex() + "/")
    typesys = tool_module("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    store.register(typesys.get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    for topic in (*keys.OUT, *keys.IN):
        package, name = topic[1]._type.split("/")
        assert keys.ros_key(topic, "r1").split("/", 2)[1] == store.generate_msgdef(f"{package}/msg/{name}")[1]


@pytest.mark.parametrize("name", ["", "*", "a/b", "r1/**", "-r", "ä", "r" * 42])
def test_a_name_that_is_no_part_of_a_key_is_refused(name):
    with pytest.raises(ValueError, match="allowed"):
        keys.check_name(name)


def test_each_robot_gets_its_own_keys_only(tmp_path):
    users = add_users(tmp_path / "users", ["order", "r2"])
    assert read_users(tmp_path / "users") == users
    tree = nested(router_settings("tcp/0.0.0.0:7447", users, tmp_path / "users"))
    rules = {rule["id"]: rule["key_exprs"] for rule in tree["access_control"]["rules"]}
    assert rules["teacher"] == ["**"]
    assert all("/order/" in key for key in rules["order"])
    assert tree["access_control"]["default_permission"] == "deny"
    (tmp_path / "users").chmod(0o644)
    with pytest.raises(ValueError, match="600"):
        read_users(tmp_path / "users")


def test_metrics_escape_what_robots_say():
    text = metrics([{"name": "r1", "id": "a", "present": True, "age": None}], {"r1": {'a "task"\n': {"level": 2}}})
    assert 'robotont_up{robot="r1",id="a"} 1\n' in text
    assert 'task="a \\"task\\"\\n",key="level"} 2\n' in text


def test_the_shipped_configuration_of_free_fleet_is_that_of_the_robots_folder():
    shipped = launch("fleet.launch").parents[1] / "config" / "fleet" / "free_fleet.yaml"
    assert shipped.read_text() == free_fleet_text("robotont3", ["robot1", "robot2"])


def test_the_dashboard_asks_for_numbers_that_there_are():
    board = json.loads((launch("fleet.launch").parents[1] / "config" / "fleet" / "grafana.json").read_text())
    asked = {name for panel in board["panels"] for target in panel["targets"]
             for name in re.findall(r"robotont_\w+", target["expr"])}
    assert asked <= {f"robotont_{name}" for name, *_ in GAUGES} | {"robotont_diagnostic"}
    keys_asked = {key for panel in board["panels"] for target in panel["targets"]
                  for key in re.findall(r'key="([^"]+)"', target["expr"])}
    sources = "".join(Path(module.__file__).read_text() for module in (link_report, fleet_node))
    assert keys_asked
    assert all(f'"{key}"' in sources for key in keys_asked)

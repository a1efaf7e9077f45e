"""The simulated robot and the model that RViz shows are one robot."""

from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

from robotont_description.model import urdf
from robotont_driver.wheels import read_wheels
from robotont_simulator.model import laser_height
from robotont_testing.robots import ROBOTS


@pytest.mark.parametrize("parameters", ROBOTS.values(), ids=ROBOTS)
def test_the_laser_measures_from_where_the_model_shows_it(parameters, tmp_path):
    file = tmp_path / "wheel_params.yaml"
    file.write_text(yaml.safe_dump(parameters))
    above = {joint.find("child").get("link"): joint for joint in ElementTree.fromstring(urdf(str(file))).iter("joint")}
    place, link = np.zeros(3), "laser"
    while link != "base_link":  # none of these frames is turned
        place += np.array(above[link].find("origin").get("xyz").split(), float)
        link = above[link].find("parent").get("link")
    np.testing.assert_allclose(place, (0.0, 0.0, laser_height(read_wheels(parameters))), rtol=0, atol=1e-9)

from test_model import ROOT

from robotont_driver.parameters import markdown_rows
from robotont_driver.path_node import PARAMETERS


def test_the_documentation_lists_the_parameters_of_path_node():
    text = (ROOT / "docs" / "description.md").read_text()
    for row in markdown_rows(PARAMETERS):
        assert row in text

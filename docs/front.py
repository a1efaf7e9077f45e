"""Hook of mkdocs: the repository's README is the site's front page; CONTRIBUTING and CHANGELOG are pages of it, too."""

import re
from pathlib import Path

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[1]
PAGES = {"README.md": "index.md", "CONTRIBUTING.md": "CONTRIBUTING.md", "CHANGELOG.md": "CHANGELOG.md"}
FILES = ("CITATION.cff", "LICENSE")


def of_the_site(text):
    """Text of a page of the repository, its links as they are in the site, where docs/ is the root."""
    return re.sub(r"(\]\()docs/", r"\1", text)


def on_files(files, config):
    """Adds what lies outside docs/."""
    for source, page in PAGES.items():
        files.append(File.generated(config, page, content=of_the_site((ROOT / source).read_text(encoding="utf-8"))))
    for name in FILES:
        files.append(File.generated(config, name, abs_src_path=str(ROOT / name)))
    return files

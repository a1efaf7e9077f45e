#!/usr/bin/env python3
"""Holds the pages for learning and doing to plain words; prints pages, words, the school year that they ask for.

check_words.py    ends with 1 when README, CONTRIBUTING, safety.md or a page of Learn or Do in mkdocs.yml asks for more
                  than GRADE school years (Flesch and Kincaid), has a sentence longer than LONGEST words, or one that
                  begins with a relative clause; or when there are more than PAGES pages or WORDS words in docs/
"""

import re
import sys
from pathlib import Path

import textstat
import yaml

FOLDER = Path(__file__).resolve().parent
GRADE, LONGEST, PAGES, WORDS = 8.0, 20, 16, 20000
RELATIVE = re.compile(r"(What|Who|Whom|Whose|Which|Whoever|Whatever|That which)\b(?!.*\?$)")


def pages_of(kind):
    """Names of the pages below a heading of mkdocs.yml's nav."""
    nav = yaml.safe_load((FOLDER.parent / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    listed = next(entry[kind] for entry in nav if kind in entry)
    return [name for entry in listed for name in entry.values()]


def sentences(text):
    """The sentences of a page: paragraphs and items, without code, tables, headings and pictures.

    What stands between backquotes counts as one plain word: it is a name that is typed.
    """
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r"(?m)^(\|.*|#.*| {4,}.*)$", "\n", text)
    text = re.sub(r"!\[[^\]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`[^`]*`", "name", text)
    text = re.sub(r"\*{1,2}([^*]+)\*{1,2}", r"\1", text)
    text = re.sub(r"(?m)^\s*(?:[-*]|\d+\.) ", "\n\n", text)
    found = []
    for block in re.split(r"\n\s*\n", text):
        line = " ".join(block.split())
        ends = re.split(r"(?<=[.?!])\s+(?=[\"(A-Zn~])", line)
        found += [one.strip() for one in ends if one.strip(" .")]
    return found


def faults(page):
    """(grade, lines that say what is wrong) of a page."""
    found = sentences((FOLDER / page).read_text(encoding="utf-8"))
    grade = textstat.flesch_kincaid_grade(" ".join(one.rstrip(".:;") + "." for one in found))
    said = [f"{page}: more than {LONGEST} words: {one}" for one in found if len(one.split()) > LONGEST]
    said += [f"{page}: begins with a relative clause: {one}" for one in found if RELATIVE.match(one)]
    if grade > GRADE:
        said.append(f"{page}: school year {grade:.1f}, at most {GRADE:g}")
    return grade, said


def main():
    """Print the table and the faults."""
    beside = ["../README.md", "../CONTRIBUTING.md"]  # their words are not counted
    held, said, sum_of_words = [*pages_of("Learn"), *pages_of("Do"), "safety.md", *beside], [], 0
    pages = sorted(path.name for path in FOLDER.glob("*.md"))
    for page in beside:
        said += faults(page)[1]
    for page in pages:
        words = len((FOLDER / page).read_text(encoding="utf-8").split())
        sum_of_words += words
        grade, wrong = faults(page)
        said += wrong if page in held else []
        print(f"{page:20}{words:6} words, school year {grade:4.1f}{' (held)' if page in held else ''}")
    print(f"(held): at most school year {GRADE:g} (grade of Flesch and Kincaid), and {LONGEST} words in a sentence")
    print(f"{len(pages)} pages, {sum_of_words} words")
    if len(pages) > PAGES or sum_of_words > WORDS:
        said.append(f"docs/: {len(pages)} pages of {sum_of_words} words, at most {PAGES} of {WORDS}; shorten one")
    for line in said:
        print(line, file=sys.stderr)
    return 1 if said else 0


if __name__ == "__main__":
    sys.exit(main())

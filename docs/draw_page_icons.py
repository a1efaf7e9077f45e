#!/usr/bin/env python3
"""Draws the PNG icons of the page for driving by hand out of its icon.svg. Needs Chromium.

They fill their square to its corners, as phones want it: each cuts out a shape of its own.
"""

import io
import re
import sys
from pathlib import Path

from PIL import Image

from robotont_testing.browser import Browser

WEB = Path(__file__).resolve().parents[1] / "robotont_teleop" / "web"
SIZES = (192, 512)  # [px]
COLOURS = 32        # enough for five plain ones and the edges between them


def main():
    """Make the icons, beside icon.svg or in the folder that the command line names."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else WEB
    drawing = re.sub(r' rx="96"', "", (WEB / "icon.svg").read_text(), count=1)
    with Browser() as browser:
        for size in SIZES:
            page = browser.page("about:blank#icon", (size, size, 1))
            page.run(f"document.body.style.margin = 0; document.body.innerHTML = {drawing!r}; "
                     "document.querySelector('svg').style.display = 'block'")
            raw = folder / f"icon-{size}.png"
            page.screenshot(raw)
            picture = Image.open(io.BytesIO(raw.read_bytes())).convert("RGB")
            picture.quantize(COLOURS, dither=0).save(raw, optimize=True)


if __name__ == "__main__":
    main()

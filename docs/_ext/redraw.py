"""Draw pictures again, each by the command in its metadata, in the folder of the picture: redraw.py FILE..."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

_DESCRIPTION = ".//{http://purl.org/dc/elements/1.1/}description"


def command_of(picture: Path) -> str:
    """The command in a PNG or SVG that kahanmaps wrote."""
    if picture.suffix == ".png":
        from PIL import Image

        with Image.open(picture) as image:
            return str(image.info["Description"])
    return str(ElementTree.parse(picture).findtext(_DESCRIPTION))


if __name__ == "__main__":
    for name in sys.argv[1:]:
        command = command_of(Path(name))
        print(command, flush=True)
        subprocess.run(shlex.split(command), cwd=Path(name).parent, check=True)

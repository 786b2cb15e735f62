"""Make the pictures of the dialogue in ``docs/images``: what ``shift-mesh demo --robot`` prints, light and dark.

It runs the dialogue with a mesh of its own and keeps the first explanations, so that the picture shows real output.

    python docs/make_dialogue_picture.py
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path

from rich._export_format import CONSOLE_SVG_FORMAT
from rich.console import Console
from rich.terminal_theme import SVG_EXPORT_THEME, TerminalTheme
from shift_cli.dialogue import Dialogue
from shift_runtime.rest_client import RestClient
from shift_simulator.user_files import find_user

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support.whole_mesh import running_mesh

IMAGES = Path(__file__).parent / "images"
TITLE = "shift-mesh demo --robot --study coffee"
EPISODES, SEED, USER = 4, 7, "B"
LIGHT = TerminalTheme(
    (250, 251, 252), (0, 0, 0),
    [(31, 41, 51), (176, 32, 32), (20, 110, 60), (120, 90, 0),
     (20, 80, 170), (140, 40, 130), (0, 105, 125), (90, 100, 110)],
    [(90, 100, 110)] * 8,
)  # fmt: skip
"""Colours on a white page; each has a contrast of 4.5 or more with the background."""
FONT_FACES = re.compile(r"@font-face \{\{.*?\}\}\n", re.DOTALL)
"""Rich's template loads fonts from another host; the picture does without."""


def main() -> None:
    """Make both pictures."""
    from shift_cli.demo_command import _study

    console = Console(record=True, width=108, force_terminal=True, color_system="truecolor", highlight=False)
    with tempfile.TemporaryDirectory() as folder, running_mesh(Path(folder)) as mesh, RestClient(mesh.url) as shift:
        Dialogue(console, _study("coffee", EPISODES), find_user(USER), EPISODES, pause_s=0.0).run(shift, SEED)
    template = FONT_FACES.sub("", CONSOLE_SVG_FORMAT)
    for name, theme in (("light", LIGHT), ("dark", SVG_EXPORT_THEME)):
        svg = console.export_svg(title=TITLE, theme=theme, clear=False, code_format=template, unique_id="dialogue")
        (IMAGES / f"dialogue-{name}.svg").write_text(re.sub(r"[ \t]+$", "", svg, flags=re.MULTILINE))


if __name__ == "__main__":
    main()

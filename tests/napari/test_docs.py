"""The pages about the plugin: their examples run, their pictures and verbs exist."""

import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from napari_crfdeblur import Session

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
PICTURE = re.compile(r"!\[([^\]]*)\]\(([^)]+)\)")
LARGEST = 350_000  # bytes of a picture: a page of ten still loads fast

# Public methods that steps and widgets need of a session, not what a script does with it.
SERVING = {
    *("do", "set_white", "source", "state_of", "white_of", "plane", "region"),
    *("required_edges", "required_response", "required_pair", "required_psf", "required_blur"),
    *("commit", "say", "say_trust"),
}

# Small, so that the example of the README takes a second.
PHOTO = """
from pathlib import Path
from napari_crfdeblur.io import write_photo
from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Camera, simulate, slanted_edges
scene = slanted_edges((120, 180), seed=2, pitch=60)
made = simulate(scene, camera_shake(5, seed=3), Camera(Gamma(1.8), noise=0.003), seed=1)
write_photo(Path("photo.png"), made.photo)
"""


def examples(page: Path) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)


def run_without_a_display(code: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """A process of its own, as a reader would have it: no display, no plugin manager of a test."""
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    environment = {name: value for name, value in os.environ.items() if name not in hidden}
    checked = f"{code}\nimport sys\nassert 'qtpy' not in sys.modules, 'Qt was loaded'\n"
    return subprocess.run(
        [sys.executable, "-c", checked],
        cwd=folder,
        env=environment | {"OMP_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=240,
    )


@pytest.mark.parametrize("name", ["scripting", "stacks"])
def test_the_examples_of_a_page_run_one_after_the_other(name: str, tmp_path: Path) -> None:
    done = run_without_a_display("\n".join(examples(DOCS / f"{name}.md")), tmp_path)
    assert done.returncode == 0, done.stderr


def test_the_example_of_the_readme_runs(tmp_path: Path) -> None:
    (example,) = [code for code in examples(ROOT / "README.md") if "ViewerModel" in code]
    done = run_without_a_display(PHOTO + example, tmp_path)
    assert done.returncode == 0, done.stderr
    assert "photo [deblurred]" in done.stdout


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_picture_of_a_page_exists_is_small_and_described(page: Path) -> None:
    for description, target in PICTURE.findall(page.read_text(encoding="utf-8")):
        path = page.parent / target
        assert path.is_file(), target
        assert len(description) > 20, target
        if path.name.startswith("napari-"):
            assert path.stat().st_size < LARGEST
            Image.open(path).verify()


def test_every_picture_that_is_taken_is_shown() -> None:
    shown = {Path(target).name for page in PAGES for _, target in PICTURE.findall(page.read_text())}
    assert {path.name for path in (DOCS / "images").glob("*.png")} == shown


def test_the_table_of_verbs_is_that_of_the_session() -> None:
    section = (DOCS / "scripting.md").read_text(encoding="utf-8").split("## Verbs")[1]
    table = section.partition("| verb |")[2].partition("\n\n")[0]
    firsts = [line.split("|")[1] for line in table.splitlines() if line.startswith("| `")]
    told = {verb for first in firsts for verb in re.findall(r"`(\w+)`", first)}
    public = {name for name, _ in inspect.getmembers(Session, inspect.isfunction) if name[0] != "_"}
    assert told == public - SERVING
    assert public > SERVING

"""What was done in the window comes back as a script that does the same without one."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from tifffile import imread, imwrite

from napari_crfdeblur import Session
from napari_crfdeblur._napari.script import expression
from napari_crfdeblur.deconvolution import HyperLaplacian, Wiener
from napari_crfdeblur.edges import Edge, EdgeStatus, Line, Rectangle
from napari_crfdeblur.estimate import (
    GivenResponse,
    MaximumLikelihood,
    NoiseModel,
    PolynomialFit,
    RankMinimization,
    Tail,
)
from napari_crfdeblur.io import read_photo, to_record, write_photo
from napari_crfdeblur.psf import XuJia, line
from napari_crfdeblur.response import SRGB, Cameras, Emor, Gamma, Tabulated, Tuned, around
from napari_crfdeblur.simulate import Simulated


def run(script: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a script in a folder, with no display to be found."""
    path = folder / "again.py"
    path.write_text(script, encoding="utf-8")
    hidden = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-W", "error::DeprecationWarning:__main__", str(path), *arguments]
    return subprocess.run(command, cwd=folder, env=hidden, capture_output=True, text=True)


def steps_of(session: Session) -> np.ndarray:
    """A session with a little of everything; returns the restored pixels."""
    session.detect_edges(12.0)
    edges = [edge for edge in session.state.edges.edges if edge.good]
    session.set_edges([*edges[:20], Line(edges[0].start, edges[0].end)])
    session.estimate_response(MaximumLikelihood(Cameras.SRGB, shift=0.2))
    session.set_response(Tuned(Gamma(1.8), (0.02,), 1.05))
    session.set_psf(line(5, 0.3))
    session.linearize(region=((10, 100), (20, 150)))
    session.deconvolve(Wiener(model_error=0.01))
    return np.asarray(session.reapply().data)


def test_the_script_gives_the_same_numbers_in_a_new_process(
    viewer: ViewerModel, blurred: Simulated, tmp_path: Path
) -> None:
    write_photo(tmp_path / "panels.png", blurred.photo[:120, :170])
    photo = viewer.add_image(read_photo(tmp_path / "panels.png"), name="a “panels”")
    session = Session(viewer, photo)
    pixels = steps_of(session)
    # Made in memory: the script asks for the file.
    done = run(session.script(), tmp_path, str(tmp_path / "panels.png"))
    assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(read_photo(tmp_path / "photo-deblurred.png"), pixels)
    assert "the result is the same, pixel by pixel" in done.stdout
    assert (tmp_path / "photo-record.json").exists()


@pytest.mark.usefixtures("plugin")
def test_a_photo_from_a_file_is_named_in_the_script(
    viewer: ViewerModel, blurred: Simulated, tmp_path: Path
) -> None:
    write_photo(tmp_path / "panels.png", blurred.photo[:90, :130])
    (photo,) = viewer.open(tmp_path / "panels.png", plugin="napari")
    session = Session(viewer, photo)
    session.set_response(SRGB())
    session.set_psf(line(3, 0.0))
    session.restore()
    assert ascii(str(tmp_path / "panels.png")) in session.script()
    done = run(session.script(), tmp_path)
    assert done.returncode == 0, done.stderr
    pixels = read_photo(tmp_path / "panels-deblurred.png")
    np.testing.assert_array_equal(pixels, session.state.restored.data)


@pytest.mark.usefixtures("plugin")
def test_a_stack_from_a_file_is_deblurred_slice_by_slice_by_the_script(
    viewer: ViewerModel, blurred: Simulated, tmp_path: Path
) -> None:
    red, green, _ = np.moveaxis(blurred.photo[:90, :130], 2, 0)
    slices = np.stack([red, green]).astype(np.uint16) * 200
    imwrite(tmp_path / "stack.tif", slices)
    (photo,) = viewer.open(tmp_path / "stack.tif", plugin="napari")
    photo.scale, photo.units, photo.axis_labels = (3, 0.5, 0.25), ("um",) * 3, ("z", "y", "x")
    session = Session(viewer, photo)
    session.set_response(SRGB())
    session.set_psf(line(3, 0.0))
    session.restore()
    done = run(session.script(), tmp_path)
    assert done.returncode == 0, done.stderr
    np.testing.assert_array_equal(
        imread(tmp_path / "stack-deblurred.tif"), session.state.restored.data
    )
    again = json.loads((tmp_path / "stack-record.json").read_text(encoding="utf-8"))["source"]
    assert again["scale"] == [3, 0.5, 0.25]
    assert again["units"] == [str(unit) for unit in photo.units]
    assert again["axis_labels"] == ["z", "y", "x"]


def test_a_stack_made_in_memory_is_read_from_the_argument(
    viewer: ViewerModel, blurred: Simulated, tmp_path: Path
) -> None:
    red, green, _ = np.moveaxis(blurred.photo[:50, :70], 2, 0)
    session = Session(viewer, viewer.add_image(np.stack([red, green]), scale=(2, 0.5, 0.25)))
    session.set_response(SRGB())
    session.set_psf(line(3, 0.0))
    session.restore(Wiener())
    imwrite(tmp_path / "in.tif", np.stack([red, green]))
    done = run(session.script(), tmp_path, str(tmp_path / "in.tif"))
    assert done.returncode == 0, done.stderr
    assert "the result is the same, pixel by pixel" in done.stdout
    pixels = imread(tmp_path / "photo-deblurred.tif")
    np.testing.assert_array_equal(pixels, session.state.restored.data)


@pytest.mark.usefixtures("plugin")
def test_a_sample_is_opened_by_the_script(viewer: ViewerModel, tmp_path: Path) -> None:
    (photo,) = viewer.open_sample("napari-crfdeblur", "step_image")
    session = Session(viewer, photo)
    session.set_response(SRGB())
    session.set_psf(line(3, 0.0))
    session.restore()
    done = run(session.script(), tmp_path)
    assert done.returncode == 0, done.stderr
    pixels = read_photo(tmp_path / "photo-deblurred.png")
    np.testing.assert_array_equal(pixels, session.state.restored.data)


NASTY = [
    'x"+str(__import__("os").mkdir("harm"))+"y.png',
    """a'''b""" + '"""\nimport os; os.mkdir("harm")\n"""',
    "line\nimport os; os.mkdir('harm')",
    "{record}{0}%s\\",
    "\x1b[31m\u202eevil\x00",
    "caf\u00e9 \u2603",
]


# Each in its folder, one after the other in one process: napari takes seconds to be imported.
ALL = """
import os, runpy, sys
for folder in sys.argv[1:]:
    os.chdir(folder)
    sys.argv = ["again.py", os.path.join(folder, "panels.png")]
    runpy.run_path("again.py", run_name="__main__")
"""


def test_a_name_is_text_in_the_script_and_never_code(blurred: Simulated, tmp_path: Path) -> None:
    folders = [tmp_path / str(number) for number in range(len(NASTY))]
    for name, folder in zip(NASTY, folders, strict=True):
        folder.mkdir()
        viewer = ViewerModel()
        session = Session(viewer, viewer.add_image(blurred.photo[:60, :70], name=name))
        session.set_response(SRGB())
        session.set_psf(line(3, 0.0))
        session.restore(Wiener())
        session.photo.axis_labels = (name, "x")
        write_photo(folder / "panels.png", blurred.photo[:60, :70])
        (folder / "again.py").write_text(session.script(), encoding="utf-8")
    done = run(ALL, tmp_path, *map(str, folders))
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("the result is the same, pixel by pixel") == len(NASTY)
    names = {"again.py", "panels.png", "photo-deblurred.png", "photo-record.json"}
    for folder in folders:
        assert {path.name for path in folder.iterdir()} == names
    assert {path.name for path in tmp_path.iterdir()} == {"again.py", *(f.name for f in folders)}


@pytest.mark.parametrize(
    "value",
    [
        None,
        3,
        0.1 + 0.2,
        "it's",
        (1, 2),
        (1,),
        [],
        Line((1.5, 2.0), (3.0, 4.25)),
        Rectangle(((0.0, 0.0), (0.0, 9.0), (4.0, 9.0), (4.0, 0.0))),
        Edge((1.0, 2.0), (3.0, 40.0), 1, 7.5, 0.25, EdgeStatus.CURVED),
        RankMinimization(Tail.ALL, polynomial=PolynomialFit(degree=4)),
        GivenResponse(Gamma(2.4)),
        Emor((0.25, -0.125)),
        Tuned(SRGB(), (0.01,), 1.1),
        XuJia(size=21),
        HyperLaplacian(weight=0.001, steps=2),
    ],
    ids=lambda value: type(value).__name__,
)
def test_a_value_comes_back_from_its_expression(value: Any) -> None:
    assert evaluated(value) == value


def test_arrays_and_curves_of_samples_come_back_exactly() -> None:
    kernel = line(7, 0.7)
    np.testing.assert_array_equal(evaluated(kernel), kernel)
    levels = np.linspace(0, 1, 9)
    curve = Tabulated(levels**1.7, levels)
    np.testing.assert_array_equal(evaluated(curve).to_intensity(levels), curve.to_intensity(levels))


@pytest.mark.parametrize(
    "method",
    [
        MaximumLikelihood(),
        MaximumLikelihood(Cameras.DORF, noise=NoiseModel(floor=2e-3), shift=0.2),
        MaximumLikelihood(psf=line(5, 0.3)),
        MaximumLikelihood(around(Gamma(1.8))),
    ],
    ids=["default", "figures", "PSF", "near a curve"],
)
def test_a_method_that_holds_arrays_comes_back_exactly(method: MaximumLikelihood) -> None:
    assert to_record(evaluated(method)) == to_record(method)


def evaluated(value: Any) -> Any:
    names: set[tuple[str, str]] = set()
    source = expression(value, names)
    scope: dict[str, Any] = {}
    for module, name in names:
        exec(f"from {module} import {name}" if name else "import numpy as np", scope)
    return eval(source, scope)

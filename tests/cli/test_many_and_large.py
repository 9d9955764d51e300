"""``crfdeblur batch``, and ``crfdeblur deblur`` in tiles."""

import shutil

import numpy as np
import pytest
import tifffile

from napari_crfdeblur.cli import large as cli_large
from napari_crfdeblur.cli import main
from napari_crfdeblur.deconvolution import RichardsonLucy
from napari_crfdeblur.io import read_photo, read_psf, write_photo, write_psf
from napari_crfdeblur.large import deblur, restore_large
from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.response import SRGB
from napari_crfdeblur.simulate import Camera, simulate, slanted_edges

KNOWN = ["--response", "srgb", "--psf", "psf.npy", "--method", "richardson-lucy"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with two blurred photos and their PSF."""
    folder, psf = tmp_path_factory.mktemp("made"), camera_shake(9, 3)
    for seed, name in enumerate(("a", "b")):
        scene = slanted_edges((158, 208), seed=seed, pitch=90, channels=3)
        photo = simulate(scene, psf, Camera(SRGB(), noise=0.002), seed=5).photo
        write_photo(folder / f"{name}.png", photo)
    tifffile.imwrite(folder / "a.tif", read_photo(folder / "a.png"), photometric="rgb")
    write_psf(folder / "psf.npy", psf)
    return folder


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch, made):
    """A copy of that folder, in which the command runs."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments):
    return main([str(each) for each in arguments])


def test_a_batch_says_what_became_of_the_photos(here, capsys):
    assert run("batch", "a.png", "b.png", "-o", "out", *KNOWN) == 0
    assert capsys.readouterr().out == "deblurred 2 of 2\n"
    assert run("batch", "a.png", "b.png", "-o", "out", *KNOWN) == 0
    assert "2 done before" in capsys.readouterr().out
    (here / "bad.png").write_text("no picture")
    assert run("batch", "a.png", "bad.png", "-o", "out", *KNOWN) == 1
    out = capsys.readouterr().out
    assert "bad.png: passed over: not a PNG" in out
    assert "deblurred 0 of 2, 1 done before, 1 passed over" in out


def test_a_batch_gives_what_deblur_gives(here):
    assert run("batch", "b.png", "-o", "out", "--suffix", "_sharp", *KNOWN) == 0
    assert run("deblur", "b.png", "-o", "one.png", *KNOWN) == 0
    found = read_photo(here / "out" / "b_sharp.png")
    np.testing.assert_array_equal(found, read_photo(here / "one.png"))


def test_a_batch_that_cannot_begin_is_refused(here, capsys):
    (here / "file").write_text("no folder")
    assert run("batch", "a.png", "-o", "file", *KNOWN) == 2
    assert "cannot make this folder" in capsys.readouterr().err
    assert run("batch", "a.png", "-o", "out", "--psf", "none.npy") == 2
    assert "no such file" in capsys.readouterr().err
    assert run("batch", "a.png", "-o", "out", "--psf", "psf.npy", "--psf-size", 9) == 2
    assert "--psf-size" in capsys.readouterr().err


@pytest.mark.parametrize("output", ["out.tif", "out.zarr"])
def test_tiles_give_what_the_whole_gives(here, output, capsys):
    assert run("deblur", "a.tif", "-o", output, "--tiled", "--report", "r.html", *KNOWN) == 0
    assert f"wrote {output}" in capsys.readouterr().out
    assert (here / "r.html").stat().st_size > 1000
    assert run("deblur", "a.tif", "-o", "whole.tif", *KNOWN) == 0
    if output == "out.zarr":
        found = pytest.importorskip("zarr").open(output, mode="r")[:]
    else:
        found = read_photo(here / output)
    np.testing.assert_array_equal(found, read_photo(here / "whole.tif"))  # there is one tile


def test_a_large_tiff_is_worked_on_in_tiles_unasked(here, monkeypatch):
    calls = []
    monkeypatch.setattr(cli_large, "PIXELS", 30000)
    original = deblur.restore_large
    monkeypatch.setattr(
        deblur, "restore_large", lambda *a, **k: calls.append(a) or original(*a, **k)
    )
    assert run("deblur", "a.tif", *KNOWN) == 0
    assert (here / "a-deblurred.tif").exists()
    assert len(calls) == 0  # 150 x 200 pixels are not more than that
    monkeypatch.setattr(cli_large, "PIXELS", 29999)
    assert run("deblur", "a.tif", *KNOWN) == 0
    assert len(calls) == 1
    assert run("deblur", "a.tif", "-o", "small.png", *KNOWN) == 0
    assert len(calls) == 1


def test_all_pages_are_restored_in_tiles(here):
    stack = np.stack([read_photo(here / f"{name}.png")[..., 1] for name in ("a", "b")])
    tifffile.imwrite(here / "stack.tif", stack, photometric="minisblack")
    assert run("deblur", "stack.tif", "--tiled", *KNOWN) == 0
    assert tifffile.imread(here / "stack-deblurred.tif").shape == stack.shape


def test_tiles_find_response_and_psf_on_a_part(here, capsys):
    assert run("deblur", "a.tif", "-o", "o.tif", "--tiled", "--blur-extent", 11) == 0
    out = capsys.readouterr().out
    assert "edges:" in out
    assert "PSF:" in out
    assert read_photo(here / "o.tif").shape == read_photo(here / "a.png").shape


def bead(here):
    """A PSF of three dimensions in the pages of a TIFF."""
    volume = np.zeros((3, 7, 7), np.uint16)
    volume[1] = np.rint(9000 * camera_shake(7, 3))
    volume[2, 2:5, 3] = 800
    tifffile.imwrite(here / "bead.tif", volume, photometric="minisblack")
    return read_psf(here / "bead.tif")


def test_a_stack_and_a_psf_of_three_dimensions_make_a_volume(here, capsys):
    stack = np.stack([read_photo(here / f"{name}.png")[:80, :90, 1] for name in "abba"])
    tifffile.imwrite(here / "stack.tif", stack, photometric="minisblack")
    psf = bead(here)
    given = ["--response", "srgb", "--psf", "bead.tif", "--method", "richardson-lucy"]
    assert run("deblur", "stack.tif", *given, "--report", "r.html") == 0
    assert "PSF: 7 x 7 x 3 pixels" in capsys.readouterr().out
    expected = restore_large(stack, SRGB(), psf, RichardsonLucy()).compute()
    np.testing.assert_array_equal(tifffile.imread(here / "stack-deblurred.tif"), expected)


def test_parts_have_their_psfs_in_tiles_too(here, capsys):
    scene, psf = slanted_edges((96, 132), seed=2, pitch=48), camera_shake(5, 3)
    write_photo(here / "c.tif", simulate(scene, psf, Camera(SRGB()), seed=5).photo)
    write_psf(here / "psf.npy", psf)
    given = ["--response", "srgb", "--psf", "psf.npy", "--varying", "1x2"]
    assert run("deblur", "c.tif", "-o", "whole.tif", *given) == 0
    assert run("deblur", "c.tif", "-o", "tiles.tif", "--tiled", *given) == 0
    assert capsys.readouterr().out.count("parts: ") == 2
    # there is one tile
    np.testing.assert_array_equal(read_photo(here / "tiles.tif"), read_photo(here / "whole.tif"))


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["deblur", "a.tif"], "the photo is a single picture; give a stack"),
        (["deblur", "a.png"], "the photo is a single picture; give a stack"),
        (["deblur", "a.tif", "--varying"], "--varying is for PSFs with rows and columns"),
        (["deblur", "a.tif", "-o", "x.png"], "written as TIFF or zarr"),
        (["batch", "a.png", "-o", "out"], "restore them one by one"),
        (["estimate", "a.png"], "grayscale picture with rows and columns"),
        (["simulate"], "grayscale picture with rows and columns"),
    ],
)
def test_what_is_no_stack_has_no_psf_of_three_dimensions(arguments, reason, capsys, here):
    bead(here)
    before = sorted(here.iterdir())
    assert run(*arguments, "--psf", "bead.tif") == 2
    assert reason in capsys.readouterr().err
    assert sorted(here.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["a.tif", "-o", "x.png", "--tiled"], "written as TIFF or zarr"),
        (["a.tif", "-o", "a.tif", "--tiled"], "is read by this run"),
        (["a.tif", "--tiled", "--save-edges", "e.json"], "worked on as a whole"),
        (["a.tif", "--tiled", "--cameras", "c"], "worked on as a whole"),
        (["none.tif", "--tiled"], "no such file"),
        (["none.zarr", "-o", "x.zarr"], "no such file"),
        (["a.tif", "--scheduler", "nonsense"], "address of a scheduler"),
    ],
)
def test_what_tiles_cannot_do_is_refused(arguments, reason, capsys, here):
    before = sorted(here.iterdir())
    assert run("deblur", *arguments, "--response", "srgb", "--psf", "psf.npy") == 2
    assert reason in capsys.readouterr().err
    assert sorted(here.iterdir()) == before

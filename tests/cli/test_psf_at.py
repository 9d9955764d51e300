"""``--psf-at`` and ``--psf streaks``: PSFs that the photo shows as they are."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import fftconvolve

from napari_crfdeblur.cli import main
from napari_crfdeblur.io import read_photo, read_psf, write_photo
from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Gamma

PSF = camera_shake(13, 4)
LAMPS = (30, 40, 0.7), (35, 130, 0.3), (96, 61, 0.5), (88, 151, 0.9)
KNOWN = ["--response", "gamma:2.2"]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with a night photo, in which the command runs."""
    light = np.full((130, 190), 0.01)
    for row, column, peak in LAMPS:
        light[row, column] += peak / PSF.max()
    blurred = np.clip(fftconvolve(light, PSF, mode="same"), 0, 1)
    noisy = np.clip(blurred + np.random.default_rng(1).normal(0, 0.002, blurred.shape), 0, 1)
    monkeypatch.chdir(tmp_path)
    photo = np.rint(255 * Gamma(2.2).to_intensity(noisy)).astype(np.uint8)
    write_photo(Path("night.png"), photo)


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one sentence of a refusal; nothing is written."""
    assert main([*words]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert [path.name for path in Path().iterdir()] == ["night.png"]
    return error


@pytest.mark.parametrize(
    "words",
    [
        ["--psf-at", "30,40,27"],
        ["--psf-at", "30,40,27", "--psf-at", "96,61,27", "--psf-at", "88,151,27"],
        ["--from", "streaks"],
        ["--from", "streaks", "--psf-size", "25"],
    ],
)
def test_the_psf_is_written_as_the_lamps_show_it(words: list[str]) -> None:
    assert main(["psf", "night.png", *KNOWN, *words, "-o", "psf.npy"]) == 0
    assert kernel_similarity(read_psf(Path("psf.npy")), PSF) > 0.97


@pytest.mark.parametrize("words", [["--psf-at", "30,40,27"], ["--psf", "streaks"]])
def test_a_record_repeats_it(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    said = ["deblur", "night.png", *KNOWN, *words, "-o", "sharp.png", "--record", "done.json"]
    assert main(said) == 0
    assert read_photo(Path("sharp.png")).max() > 200
    assert main(["repeat", "done.json", "night.png"]) == 0
    assert "same" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--psf-at", "30,40"], "ROW,COLUMN,SIZE"),
        (["--psf-at", "30,40,5"], "from 7 to 999"),
        (["--psf-at", "30,x,15"], "ROW,COLUMN,SIZE"),
        (["--psf-at=-3,4,15"], "ROW,COLUMN,SIZE"),
        (["--psf-at", "30,40,27", "--psf-size", "9"], "leave out --psf-size"),
        (["--psf-at", "30,40,27", "--psf", "edges"], "leave out --psf"),
        (["--psf-at", "30,40,27", "--psf-at", "96,61,25"], "one SIZE"),
        (["--psf-at", "30,40,199"], "beyond the picture"),
        (["--psf-at", "65,95,15"], "nothing stands out"),
        (["--psf-at", "30,40,27", "--tiled", "-o", "out.tif"], "as a whole"),
    ],
)
def test_what_does_not_fit_is_refused_with_advice(
    words: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reason in refused(capsys, "deblur", "night.png", *KNOWN, *words)


def test_a_photo_without_streaks_is_refused_with_advice(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_photo(Path("night.png"), np.tile(np.arange(0, 190, dtype=np.uint8), (130, 1)))
    words = ["deblur", "night.png", *KNOWN, "--psf", "streaks"]
    assert "let the picture tell the PSF" in refused(capsys, *words)

"""The blur in files: what is written comes back, and what is none is refused."""

from pathlib import Path

import numpy as np
import pytest
import tifffile

from napari_crfdeblur import CrfDeblurError
from napari_crfdeblur._napari.blur_files import read_blur, write_blur
from napari_crfdeblur.psf import Poses, PsfField, PsfStatus, line

VOLUME = np.random.default_rng(3).random((3, 7, 5))
VOLUME /= VOLUME.sum()


@pytest.fixture(scope="module")
def field() -> PsfField:
    psfs = np.stack([line(5, 0.2), line(5, 0.2)[::-1]])[None]
    statuses = ((PsfStatus.GOOD, PsfStatus.BORROWED),)
    poses = Poses(np.array([0.0, 0.1]), np.full((2, 3, 3), 1 / 18))
    return PsfField(psfs, statuses, (40, 60), poses, {"turn": 0.5})


def test_the_psfs_of_parts_come_back_from_json(tmp_path: Path, field: PsfField) -> None:
    write_blur(tmp_path / "psf.json", line(5, 0.2), field)
    psf, again = read_blur(tmp_path / "psf.json")
    np.testing.assert_array_equal(psf, line(5, 0.2))
    assert again is not None
    np.testing.assert_array_equal(again.psfs, field.psfs)
    np.testing.assert_array_equal(again.at(3.0, 50.0), field.at(3.0, 50.0))
    assert (again.statuses, again.shape, again.diagnostics) == (
        field.statuses,
        field.shape,
        field.diagnostics,
    )


@pytest.mark.parametrize("suffix", [".npy", ".tif", ".TIFF", ".json"])
def test_a_psf_of_three_dimensions_comes_back(tmp_path: Path, suffix: str) -> None:
    write_blur(tmp_path / f"psf{suffix}", VOLUME, None)
    psf, field = read_blur(tmp_path / f"psf{suffix}")
    np.testing.assert_allclose(psf, VOLUME, rtol=1e-6)  # float32 in TIFF
    assert field is None


@pytest.mark.parametrize("suffix", [".npy", ".tif", ".png", ".json"])
def test_a_single_psf_comes_back(tmp_path: Path, suffix: str) -> None:
    write_blur(tmp_path / f"psf{suffix}", line(5, 0.2), None)
    psf, field = read_blur(tmp_path / f"psf{suffix}")
    np.testing.assert_allclose(psf, line(5, 0.2), atol=1e-4)  # 16 bits in PNG
    assert field is None


def test_a_stack_of_measured_pictures_is_a_volume(tmp_path: Path) -> None:
    bead = (VOLUME * 60000).astype(np.uint16)
    tifffile.imwrite(tmp_path / "bead.tif", bead, photometric="minisblack", compression="zlib")
    psf, _ = read_blur(tmp_path / "bead.tif")
    np.testing.assert_allclose(psf, bead / bead.sum(), rtol=1e-12)  # rounding


@pytest.mark.parametrize("suffix", [".npy", ".tif", ".png"])
def test_parts_are_written_to_json_alone(tmp_path: Path, suffix: str, field: PsfField) -> None:
    with pytest.raises(CrfDeblurError, match=r"kept as \.json"):
        write_blur(tmp_path / f"psf{suffix}", line(5, 0.2), field)
    with pytest.raises(CrfDeblurError, match=r"\.npy"):
        write_blur(tmp_path / "psf.txt", line(5, 0.2), field)
    assert not list(tmp_path.iterdir())


def test_a_volume_is_no_png(tmp_path: Path) -> None:
    with pytest.raises(CrfDeblurError, match=r"ends in \.tif or \.npy"):
        write_blur(tmp_path / "psf.png", VOLUME, None)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("no JSON", "not a JSON file"),
        ("[1]", "not a PSF"),
        ('{"format": "crfdeblur-edges", "version": 1}', "not a PSF"),
        ('{"format": "crfdeblur-psf", "version": 2}', "later version"),
        ('{"format": "crfdeblur-psf", "version": 1}', "damaged"),
        ('{"format": "crfdeblur-psf", "version": 1, "psf": 5, "field": null}', "damaged"),
        ('{"format": "crfdeblur-psf", "version": 1, "psf": {"type": "array"}}', "damaged"),
        ('{"format": "crfdeblur-psf", "version": 1, "psf": {"type": "Strange"}}', "not known"),
    ],
)
def test_json_that_is_no_psf_is_refused(tmp_path: Path, content: str, sentence: str) -> None:
    path = tmp_path / "psf.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(CrfDeblurError, match=sentence):
        read_blur(path)


def test_a_damaged_or_missing_file_is_said(tmp_path: Path) -> None:
    for name in ("missing.json", "missing.npy", "missing.tif"):
        with pytest.raises(CrfDeblurError, match=name):
            read_blur(tmp_path / name)
    np.save(tmp_path / "cut.npy", VOLUME)
    whole = (tmp_path / "cut.npy").read_bytes()
    (tmp_path / "cut.npy").write_bytes(whole[:-40])
    with pytest.raises(CrfDeblurError, match=r"cut\.npy"):
        read_blur(tmp_path / "cut.npy")

"""PSFs in pictures and arrays: scaled, centered, and refused if they are none."""

import numpy as np
import pytest
import tifffile
from PIL import Image as Pillow
from scipy.ndimage import center_of_mass

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import read_psf, write_psf
from napari_crfdeblur.psf import as_psf


def a_psf():
    """An L, with its center of mass near the middle; no symmetry, sides that differ."""
    psf = np.zeros((9, 13))
    psf[2:7, 5] = (1.0, 2.0, 3.0, 2.0, 1.0)
    psf[6, 5:9] = (1.0, 1.5, 1.0, 0.5)
    return as_psf(psf)


@pytest.mark.parametrize(
    ("name", "tolerance"),
    # Rounding of float64; of float32; half a level of 16 bits relative to the peak.
    [("k.npy", 1e-16), ("k.tif", 1e-8), ("k.png", 4e-6)],
)
def test_a_psf_comes_back(tmp_path, name, tolerance):
    write_psf(tmp_path / name, a_psf())
    first = read_psf(tmp_path / name)
    assert first.dtype == np.float64
    assert first.sum() == pytest.approx(1, abs=1e-12)
    rows, columns = np.nonzero(first > 1e-9)
    inner = first[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    np.testing.assert_allclose(inner, a_psf()[2:7, 5:9], atol=tolerance)


def test_a_psf_is_read_with_its_mass_in_the_middle_and_odd_sides(tmp_path):
    drawn = np.zeros((20, 31), dtype=np.uint8)
    drawn[1:4, 20:28] = 77
    Pillow.fromarray(drawn).save(tmp_path / "k.png")
    psf = read_psf(tmp_path / "k.png")
    assert psf.shape[0] % 2 == psf.shape[1] % 2 == 1
    offset = np.array(center_of_mass(psf)) - np.array(psf.shape) // 2
    assert np.abs(offset).max() <= 0.5  # moved by whole pixels
    assert np.count_nonzero(psf) == 24


def test_color_picture_with_equal_channels_is_gray(tmp_path):
    gray = np.rint(a_psf() / a_psf().max() * 255).astype(np.uint8)
    Pillow.fromarray(gray).save(tmp_path / "gray.png")
    Pillow.fromarray(np.stack([gray] * 3, axis=2)).save(tmp_path / "rgb.png")
    rgba = np.stack([*[gray] * 3, np.full_like(gray, 255)], axis=2)
    Pillow.fromarray(rgba).save(tmp_path / "rgba.png")
    for name in ("rgb.png", "rgba.png"):
        np.testing.assert_array_equal(read_psf(tmp_path / name), read_psf(tmp_path / "gray.png"))


def a_volume():
    """An L that leans; no symmetry, sides that differ, off center along all axes."""
    volume = np.zeros((5, 9, 13))
    volume[1, 1:6, 4] = (1.0, 2.0, 3.0, 2.0, 1.0)
    volume[3, 5, 4:9] = (1.0, 1.0, 1.5, 1.0, 0.5)
    return as_psf(volume)


@pytest.mark.parametrize(("name", "tolerance"), [("k.npy", 1e-16), ("k.tif", 1e-8)])
def test_a_psf_of_three_dimensions_comes_back_centered(tmp_path, name, tolerance):
    write_psf(tmp_path / name, a_volume())
    psf = read_psf(tmp_path / name)
    offset = np.array(center_of_mass(psf)) - np.array(psf.shape) // 2
    assert np.abs(offset).max() <= 0.5  # moved by whole pixels
    assert all(side % 2 for side in psf.shape)
    where, whole = (
        tuple(map(slice, np.min(f, axis=1), np.max(f, axis=1) + 1))
        for f in (np.nonzero(psf > 1e-9), np.nonzero(a_volume()))
    )
    np.testing.assert_allclose(psf[where], a_volume()[whole], atol=tolerance)


@pytest.mark.parametrize(
    "options",
    [
        {"compression": "zlib"},
        {"imagej": True, "metadata": {"axes": "ZYX"}},
        {"photometric": "miniswhite"},
        {"tile": (16, 16), "bigtiff": True},
    ],
)
def test_a_bead_in_the_pages_of_a_tiff_is_a_volume(tmp_path, options):
    bead = np.rint(a_volume() / a_volume().max() * 60000).astype(np.uint16)
    stored = ~bead if options.get("photometric") == "miniswhite" else bead
    tifffile.imwrite(tmp_path / "k.tif", stored, **{"photometric": "minisblack", **options})
    np.save(tmp_path / "k.npy", bead)
    np.testing.assert_array_equal(read_psf(tmp_path / "k.tif"), read_psf(tmp_path / "k.npy"))


def test_a_volume_of_which_pages_are_missing_is_refused(tmp_path):
    bead = a_volume().astype(np.float32)
    tifffile.imwrite(tmp_path / "k.tif", bead, photometric="minisblack", compression="zlib")
    whole = (tmp_path / "k.tif").read_bytes()
    (tmp_path / "k.tif").write_bytes(whole[: len(whole) - 100])
    with pytest.raises(CrfDeblurError, match=r"k\.tif: .*get a whole copy"):
        read_psf(tmp_path / "k.tif")


def test_a_volume_in_time_or_as_a_png_is_refused(tmp_path):
    tifffile.imwrite(tmp_path / "k.tif", np.ones((2, 3, 5, 7), np.uint8), photometric="minisblack")
    with pytest.raises(CrfDeblurError, match=r"k\.tif: the PSF has shape"):
        read_psf(tmp_path / "k.tif")
    with pytest.raises(CrfDeblurError, match=r"ends in \.tif or \.npy"):
        write_psf(tmp_path / "k.png", a_volume())


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (a_psf() - 1e-3, "negative"),
        (np.zeros((5, 7)), "zero everywhere"),
        (np.where(a_psf() > 0.1, np.nan, a_psf()), "not finite"),
        (np.where(a_psf() > 0.1, np.inf, a_psf()), "not finite"),
        (np.ones((5, 7, 3)), "shape"),
        (np.ones(5), "shape"),
        (np.ones(()), "shape"),
        (np.ones((0, 3)), "empty"),
        (np.ones((3, 5), dtype=complex), "no real numbers"),
        (np.full((3, 5), "a"), "no real numbers"),
    ],
)
def test_an_array_that_is_no_psf_is_refused_in_words(tmp_path, values, reason):
    np.save(tmp_path / "k.npy", values)
    with pytest.raises(CrfDeblurError, match=rf"k\.npy: .*{reason}"):
        read_psf(tmp_path / "k.npy")


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (a_psf() - 1e-3, "negative"),
        (np.full((8, 9), np.nan), "not finite"),
        (np.zeros((8, 9)), "zero everywhere"),
    ],
)
def test_a_tiff_that_is_no_psf_is_refused_in_words(tmp_path, values, reason):
    tifffile.imwrite(tmp_path / "k.tif", values.astype(np.float32))
    with pytest.raises(CrfDeblurError, match=rf"k\.tif: .*{reason}"):
        read_psf(tmp_path / "k.tif")


def test_a_color_picture_is_refused(tmp_path):
    values = np.random.default_rng(2).integers(0, 256, (7, 9, 3), dtype=np.uint8)
    Pillow.fromarray(values).save(tmp_path / "k.png")
    with pytest.raises(CrfDeblurError, match=r"k\.png: .*grayscale"):
        read_psf(tmp_path / "k.png")


def test_a_pickle_is_never_loaded(tmp_path):
    np.save(tmp_path / "k.npy", np.array([{"a": 1}, None]), allow_pickle=True)
    with pytest.raises(CrfDeblurError, match="not a whole NPY file"):
        read_psf(tmp_path / "k.npy")


@pytest.mark.parametrize("share", [0, 0.02, 0.1, 0.5, 0.99])
def test_truncated_array_is_refused(tmp_path, share):
    np.save(tmp_path / "k.npy", a_psf())
    whole = (tmp_path / "k.npy").read_bytes()
    (tmp_path / "k.npy").write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(CrfDeblurError, match=r"k\.npy: not a whole NPY file"):
        read_psf(tmp_path / "k.npy")


@pytest.mark.parametrize("header", [b"{'descr': [[", b"{'shape': (-1, 3)}", b"\x00" * 60])
def test_damaged_header_of_an_array_is_refused(tmp_path, header):
    np.save(tmp_path / "k.npy", a_psf())
    whole = bytearray((tmp_path / "k.npy").read_bytes())
    whole[10 : 10 + len(header)] = header
    (tmp_path / "k.npy").write_bytes(whole)
    with pytest.raises(CrfDeblurError, match=r"k\.npy: not a whole NPY file"):
        read_psf(tmp_path / "k.npy")


def test_several_arrays_in_one_file_are_refused(tmp_path):
    with (tmp_path / "k.npy").open("wb") as file:
        np.savez(file, a=a_psf(), b=a_psf())
    with pytest.raises(CrfDeblurError, match="give one array"):
        read_psf(tmp_path / "k.npy")


def test_missing_psf_and_other_suffix_are_refused(tmp_path):
    with pytest.raises(CrfDeblurError, match="no such file"):
        read_psf(tmp_path / "k.npy")
    with pytest.raises(CrfDeblurError, match=r"ends in \.png"):
        write_psf(tmp_path / "k.jpg", a_psf())

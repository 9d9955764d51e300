"""Photos in files: every kind comes back as it was, and damaged files are refused."""

import struct
from contextlib import suppress

import numpy as np
import pytest
import tifffile
from PIL import Image as Pillow
from PIL import ImageCms, PngImagePlugin
from PIL.ExifTags import Base

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.io import read_photo, write_photo
from napari_crfdeblur.photo import from_unit

GREY, RGB, RGBA = (23, 37), (23, 37, 3), (23, 37, 4)
# What each orientation of the EXIF standard says was done to the upright picture.
STORED = {
    1: lambda upright: upright,
    2: np.fliplr,
    3: lambda upright: np.rot90(upright, 2),
    4: np.flipud,
    5: lambda upright: np.swapaxes(upright, 0, 1),
    6: np.rot90,
    7: lambda upright: np.rot90(np.swapaxes(upright, 0, 1), 2),
    8: lambda upright: np.rot90(upright, -1),
}


def a_photo(shape, dtype=np.uint8):
    """Noise: no symmetry, every byte matters."""
    return from_unit(np.random.default_rng(7).random(shape), dtype)


def smooth(shape):
    """An asymmetric ramp that JPEG keeps to a few levels."""
    rows, columns = np.mgrid[: shape[0], : shape[1]]
    plane = 40 + 2 * rows + columns
    return np.stack([plane, plane // 2, 255 - plane], axis=2).astype(np.uint8)


@pytest.mark.parametrize("shape", [GREY, RGB, RGBA])
@pytest.mark.parametrize(
    ("suffix", "dtype"),
    [
        (".png", np.uint8),
        (".png", np.uint16),
        (".tif", np.uint8),
        (".tif", np.uint16),
        (".tiff", np.float32),
        (".TIF", np.float64),
    ],
)
def test_a_photo_comes_back_as_it_was_written(tmp_path, suffix, dtype, shape):
    photo = a_photo(shape, dtype)
    path = tmp_path / f"photo{suffix}"
    write_photo(path, photo)
    back = read_photo(path)
    assert back.dtype == dtype
    np.testing.assert_array_equal(back, photo)


@pytest.mark.parametrize("view", [np.s_[::2, ::-1], np.s_[..., ::-1]])
def test_a_view_is_written_like_its_copy(tmp_path, view):
    photo = a_photo(RGB)[view]
    for name in ("a.png", "a.tif"):
        write_photo(tmp_path / name, photo)
        np.testing.assert_array_equal(read_photo(tmp_path / name), photo)


@pytest.mark.parametrize("shape", [GREY, RGB])
def test_floats_become_16_bits_in_png(tmp_path, shape):
    photo = a_photo(shape, np.float32)
    write_photo(tmp_path / "a.png", photo)
    back = read_photo(tmp_path / "a.png")
    assert back.dtype == np.uint16
    # Half a level, and the rounding of float32.
    np.testing.assert_allclose(back / 65535, photo, atol=0.51 / 65535)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_jpeg_keeps_a_smooth_photo_to_a_few_levels(tmp_path, dtype):
    photo = smooth(RGB)
    opaque = np.dstack([photo, np.full(GREY, 255, dtype=np.uint8)])
    write_photo(tmp_path / "a.jpg", from_unit(opaque / 255, dtype))
    back = read_photo(tmp_path / "a.jpg")
    assert (back.shape, back.dtype) == (RGB, np.uint8)
    # Quality 95 without subsampling: steps of at most 5 levels in the frequencies here.
    assert np.abs(back.astype(int) - photo).max() <= 5


def test_gray_jpeg_stays_gray(tmp_path):
    write_photo(tmp_path / "a.jpg", smooth(RGB)[..., 0])
    assert read_photo(tmp_path / "a.jpg").shape == GREY


@pytest.mark.parametrize("compression", ["lzw", "zlib", "packbits", "jpeg"])
def test_compressed_tiff_is_read(tmp_path, compression):
    photo = smooth((64, 80))
    options = {"compressionargs": {"level": 98}} if compression == "jpeg" else {}
    options["photometric"] = "rgb"
    tifffile.imwrite(tmp_path / "a.tif", photo, compression=compression, **options)
    # JPEG is lossy in TIFF, too, and halves the resolution of color; the rest is exact.
    limit = 6 if compression == "jpeg" else 0
    assert np.abs(read_photo(tmp_path / "a.tif").astype(int) - photo).max() <= limit


@pytest.mark.parametrize("shape", [RGB, RGBA])
@pytest.mark.parametrize("tile", [None, (16, 16)])
def test_planar_tiff_has_its_channels_last(tmp_path, shape, tile):
    photo = a_photo(shape, np.uint16)
    planes = np.ascontiguousarray(np.moveaxis(photo, 2, 0))
    options = {"photometric": "rgb", "planarconfig": "separate", "tile": tile}
    tifffile.imwrite(tmp_path / "a.tif", planes, **options)
    np.testing.assert_array_equal(read_photo(tmp_path / "a.tif"), photo)


@pytest.mark.parametrize("options", [{"byteorder": ">"}, {"bigtiff": True}])
def test_every_header_of_tiff_is_read(tmp_path, options):
    photo = a_photo(GREY, np.uint16)
    tifffile.imwrite(tmp_path / "a.tif", photo, **options)
    np.testing.assert_array_equal(read_photo(tmp_path / "a.tif"), photo)


def test_tiff_in_which_white_is_zero_is_not_shown_as_a_negative(tmp_path):
    photo = a_photo(GREY)
    tifffile.imwrite(tmp_path / "a.tif", 255 - photo, photometric="miniswhite")
    np.testing.assert_array_equal(read_photo(tmp_path / "a.tif"), photo)


def test_palette_tiff_shows_its_colors(tmp_path):
    picture = Pillow.fromarray(a_photo(RGB)).quantize(16)
    picture.save(tmp_path / "a.tif")
    shown = np.asarray(picture.convert("RGB"))
    np.testing.assert_array_equal(read_photo(tmp_path / "a.tif"), shown)


def test_first_page_of_a_tiff_is_the_photo(tmp_path):
    pages = a_photo((3, *GREY))
    tifffile.imwrite(tmp_path / "a.tif", pages, photometric="minisblack")
    np.testing.assert_array_equal(read_photo(tmp_path / "a.tif"), pages[0])


@pytest.mark.parametrize("orientation", STORED)
@pytest.mark.parametrize("suffix", [".jpg", ".png"])
def test_photo_is_read_upright(tmp_path, suffix, orientation):
    upright = smooth(RGB)
    exif = Pillow.Exif()
    exif[Base.Orientation] = orientation
    stored = Pillow.fromarray(np.ascontiguousarray(STORED[orientation](upright)))
    options = {"quality": 98, "subsampling": 0} if suffix == ".jpg" else {}
    stored.save(tmp_path / f"a{suffix}", exif=exif, **options)
    back = read_photo(tmp_path / f"a{suffix}")
    assert back.shape == upright.shape
    assert np.abs(back.astype(int) - upright).max() <= 4  # what JPEG takes of a smooth ramp


@pytest.mark.parametrize("orientation", STORED)
def test_tiff_is_read_upright(tmp_path, orientation):
    upright = a_photo(RGB)
    stored = np.ascontiguousarray(STORED[orientation](upright))
    extra = [("Orientation", "H", 1, orientation, True)]
    tifffile.imwrite(tmp_path / "a.tif", stored, photometric="rgb", extratags=extra)
    np.testing.assert_array_equal(read_photo(tmp_path / "a.tif"), upright)


def test_palette_png_shows_its_colors(tmp_path):
    picture = Pillow.fromarray(a_photo(RGB)).quantize(16)
    picture.save(tmp_path / "a.png")
    back = read_photo(tmp_path / "a.png")
    np.testing.assert_array_equal(back[..., :3], np.asarray(picture.convert("RGB")))


def test_1_bit_png_is_black_and_white(tmp_path):
    mask = a_photo(GREY) > 99
    Pillow.fromarray(mask).save(tmp_path / "a.png")
    np.testing.assert_array_equal(read_photo(tmp_path / "a.png"), mask * np.uint8(255))


def test_gray_png_with_alpha_becomes_rgba(tmp_path):
    pair = a_photo((*GREY, 2))
    Pillow.fromarray(pair, mode=None).save(tmp_path / "a.png")
    back = read_photo(tmp_path / "a.png")
    np.testing.assert_array_equal(back, pair[..., [0, 0, 0, 1]])


def test_cmyk_jpeg_becomes_rgb(tmp_path):
    Pillow.fromarray(smooth(RGB)).convert("CMYK").save(tmp_path / "a.jpg", quality=98)
    assert read_photo(tmp_path / "a.jpg").shape == RGB


def test_the_content_says_what_a_file_is_not_its_name(tmp_path):
    photo = a_photo(RGB)
    write_photo(tmp_path / "a.png", photo)
    (tmp_path / "a.png").rename(tmp_path / "a.jpg")
    np.testing.assert_array_equal(read_photo(tmp_path / "a.jpg"), photo)


@pytest.mark.parametrize(
    "start", [b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"II*\0", b"hello\n"]
)
def test_what_is_no_image_is_refused(tmp_path, start):
    path = tmp_path / "a.png"
    path.write_bytes(start)
    with pytest.raises(CrfDeblurError, match=r"a\.png: (not a PNG|.*truncated or damaged)"):
        read_photo(path)


def test_missing_file_and_folder_are_refused(tmp_path):
    with pytest.raises(CrfDeblurError, match="no such file; check the name"):
        read_photo(tmp_path / "none.png")
    with pytest.raises(CrfDeblurError, match="a folder; give a file"):
        read_photo(tmp_path)


def whole_files(folder):
    """Files of every kind, whole."""
    photo = a_photo((61, 83, 3))
    write_photo(folder / "8.png", photo)
    write_photo(folder / "16.png", from_unit(photo / 255, np.uint16))
    write_photo(folder / "a.jpg", photo)
    Pillow.fromarray(photo).save(folder / "progressive.jpg", progressive=True)
    write_photo(folder / "zlib.tif", photo)
    for name, options in {
        "plain": {},
        "strips": {"rowsperstrip": 8, "compression": "lzw"},
        "jpeg": {"compression": "jpeg"},
        "tiles": {"tile": (16, 16), "compression": "zlib"},
        "big": {"bigtiff": True},
    }.items():
        tifffile.imwrite(folder / f"{name}.tif", photo, photometric="rgb", **options)
    # A picture that ends before its directory, as Pillow writes it.
    Pillow.fromarray(photo).save(folder / "pillow.tif", compression="tiff_lzw")
    return sorted(folder.iterdir())


@pytest.mark.parametrize("share", [0.001, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97])
def test_truncated_image_is_refused_and_never_half_read(tmp_path, share):
    for path in whole_files(tmp_path):
        whole = path.read_bytes()
        path.write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(CrfDeblurError, match=path.name):
            pytest.fail(f"{path.name}: {read_photo(path).shape}")


@pytest.mark.parametrize("seed", range(6))
def test_damaged_image_is_refused_or_read_but_nothing_else_escapes(tmp_path, seed):
    rng = np.random.default_rng(seed)
    for path in whole_files(tmp_path):
        content = np.frombuffer(path.read_bytes(), dtype=np.uint8).copy()
        places = rng.integers(8, content.size, 12)
        content[places] = rng.integers(0, 256, places.size)
        content[8 + seed :: content.size // 7] ^= 255
        path.write_bytes(content.tobytes())
        with suppress(CrfDeblurError):
            assert read_photo(path).ndim in (2, 3)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (np.zeros(GREY, dtype=np.int32), "kind int32"),
        (np.zeros(GREY, dtype=np.int16), "kind int16"),
        (np.zeros(GREY, dtype=np.uint32), "kind uint32"),
        (np.zeros(GREY, dtype=np.complex64), "kind complex64"),
        (np.zeros((9, 10, 5), dtype=np.uint8), "shape"),
    ],
)
def test_unsupported_pixels_are_refused_in_words(tmp_path, values, reason):
    options = {"planarconfig": "contig"} if values.ndim == 3 else {}
    tifffile.imwrite(tmp_path / "a.tif", values, photometric="minisblack", **options)
    with pytest.raises(CrfDeblurError, match=reason):
        read_photo(tmp_path / "a.tif")


def test_gif_is_refused_with_advice(tmp_path):
    Pillow.fromarray(a_photo(GREY)).save(tmp_path / "a.gif")
    with pytest.raises(CrfDeblurError, match="convert it"):
        read_photo(tmp_path / "a.gif")


def test_image_of_absurd_size_is_refused_before_it_is_decoded(tmp_path):
    write_photo(tmp_path / "a.png", a_photo(GREY))
    content = bytearray((tmp_path / "a.png").read_bytes())
    content[16:24] = struct.pack(">II", 60000, 60000)
    content[29:33] = struct.pack(">I", PngImagePlugin._crc32(bytes(content[12:29])))
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(CrfDeblurError, match=r"too large|damaged"):
        read_photo(tmp_path / "a.png")


def camera_photo(path):
    """A photo on its side with a color profile and a camera's name; its upright pixels."""
    exif = Pillow.Exif()
    exif[Base.Orientation] = 6
    exif[Base.Make] = "A camera"
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    stored = Pillow.fromarray(np.ascontiguousarray(np.rot90(smooth(RGB))))
    stored.save(path, exif=exif, icc_profile=profile)
    return read_photo(path), profile


@pytest.mark.parametrize("source", ["source.jpg", "source.png"])
@pytest.mark.parametrize("target", ["a.jpg", "a.png"])
def test_camera_data_and_color_profile_are_kept_marked_upright(tmp_path, source, target):
    photo, profile = camera_photo(tmp_path / source)
    write_photo(tmp_path / target, photo, like=tmp_path / source)
    with Pillow.open(tmp_path / target) as written:
        assert written.getexif()[Base.Make] == "A camera"
        assert written.getexif().get(Base.Orientation, 1) == 1
        assert written.info["icc_profile"] == profile
    assert read_photo(tmp_path / target).shape == photo.shape


def test_photo_like_a_tiff_has_no_camera_data(tmp_path):
    write_photo(tmp_path / "a.tif", a_photo(RGB))
    write_photo(tmp_path / "a.jpg", smooth(RGB), like=tmp_path / "a.tif")
    with Pillow.open(tmp_path / "a.jpg") as written:
        assert len(written.getexif()) == 0

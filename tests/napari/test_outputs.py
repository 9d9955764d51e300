"""Laws of the layers that a session adds: place, contrast, kind of number, names, inputs."""

from typing import Any

import dask.array as da
import numpy as np
import pytest
from napari.components import ViewerModel
from napari.layers import Image
from napari.utils.transforms import Affine

from napari_crfdeblur import CrfDeblurError, Session
from napari_crfdeblur._napari.regions import visible_part
from napari_crfdeblur.photo import from_unit
from napari_crfdeblur.psf import disk, line
from napari_crfdeblur.response import Gamma
from napari_crfdeblur.simulate import Simulated

SPATIAL = ("scale", "translate", "rotate", "shear", "affine", "units", "axis_labels")
ROWS, COLUMNS = 40, 56
PSF = line(5, 0.3)

# Every way of placing a picture at once.
PLACE = {
    "scale": (0.5, 0.25),
    "translate": (3.0, -7.0),
    "rotate": 20,
    "shear": (0.3,),
    "affine": Affine(scale=(1, 1.5), rotate=5, translate=(2, 1)).affine_matrix,
    "units": ("um", "um"),
    "axis_labels": ("y", "x"),
}
STACK_PLACE = {
    "scale": (2.0, 0.5, 0.25),
    "translate": (10.0, 3.0, -7.0),
    # within the slices
    "rotate": [[1, 0, 0], [0, np.cos(0.4), -np.sin(0.4)], [0, np.sin(0.4), np.cos(0.4)]],
    "shear": (0, 0, 0.3),
    "affine": Affine(scale=(1, 1, 1.5), translate=(4, 2, 1)).affine_matrix,
    "units": ("um", "um", "um"),
    "axis_labels": ("z", "y", "x"),
}


def gray(shape: tuple[int, ...], seed: int = 0) -> Any:
    return np.random.default_rng(seed).uniform(0.1, 0.8, shape)


def pictures() -> dict[str, tuple[Any, dict[str, Any]]]:
    """Data and options of a layer of every kind that is worked on."""
    picture, stack = gray((ROWS, COLUMNS)), gray((3, ROWS, COLUMNS))
    color, clear = gray((ROWS, COLUMNS, 3)), gray((ROWS, COLUMNS, 4))
    u8, u16 = from_unit(picture, np.uint8), from_unit(stack, np.uint16)
    return {
        "gray uint8": (u8, {"colormap": "green", **PLACE}),
        "gray float64": (picture, PLACE),
        "gray float16": (picture.astype(np.float16), PLACE),
        "RGB uint8": (from_unit(color, np.uint8), {"rgb": True, **PLACE}),
        "RGB uint16": (from_unit(color, np.uint16), {"rgb": True, **PLACE}),
        "RGB float32": (color.astype(np.float32), {"rgb": True, **PLACE}),
        "RGBA uint8": (from_unit(clear, np.uint8), {"rgb": True, **PLACE}),
        "stack uint16": (u16, {"colormap": "magenta", **STACK_PLACE}),
        "stack of colors": (from_unit(gray((2, ROWS, COLUMNS, 3)), np.uint8), {"rgb": True}),
        "time and z": (from_unit(gray((2, 2, ROWS, COLUMNS)), np.uint8), {}),
        "dask": (da.from_array(u16, chunks=(1, ROWS, COLUMNS)), STACK_PLACE),
        "multiscale": ([u8, u8[::2, ::2]], {"multiscale": True, **PLACE}),
        "dask, multiscale": (
            [da.from_array(u8), da.from_array(u8[::2, ::2])],
            {"multiscale": True, **PLACE},
        ),
    }


PICTURES = pictures()


def opened(data: Any, options: dict[str, Any]) -> Session:
    """A session with a response and a PSF on a layer."""
    viewer = ViewerModel()
    photo = viewer.add_image(data, name="photo", contrast_limits=(0.05, 200), gamma=0.8, **options)
    session = Session(viewer, photo)
    session.set_response(Gamma(2.2))
    session.set_psf(PSF)
    return session


def finest(layer: Image) -> Any:
    return np.asarray(layer.data[0] if layer.multiscale else layer.data)


def corners(region: tuple[slice, ...]) -> list[Any]:
    """Indices of a region's first and last pixel, and of one between."""
    first = [axis.start for axis in region]
    last = [axis.stop - 1 for axis in region]
    return [first, last, [(a + 2 * b) // 3 for a, b in zip(first, last, strict=True)]]


def assert_in_place(layer: Image, photo: Image, region: tuple[slice, ...]) -> None:
    """Each pixel of a layer lies where that of the photo lies of which it was made."""
    start = np.array([axis.start for axis in region])
    for index in corners(region):
        there = layer.data_to_world(np.array(index) - start)
        np.testing.assert_allclose(there, photo.data_to_world(index), atol=1e-9)


@pytest.mark.parametrize("kind", PICTURES)
def test_results_lie_where_the_photo_lies_and_look_like_it(kind: str) -> None:
    session = opened(*PICTURES[kind])
    photo, restored = session.photo, session.restore()
    linear, sharp = session.state.linear.layer, session.state.sharp.layer
    for layer in (linear, sharp, restored, session.compare_with()):
        for name in SPATIAL:
            mine, its = getattr(layer, name), getattr(photo, name)
            if name == "affine":
                mine, its = mine.affine_matrix, its.affine_matrix
            assert np.all(np.asarray(mine) == np.asarray(its)), name
        assert layer.rgb == photo.rgb
        assert not layer.multiscale
        if not photo.rgb:
            assert layer.colormap.name == photo.colormap.name
    assert list(restored.contrast_limits) == list(photo.contrast_limits)
    assert restored.gamma == photo.gamma
    assert restored.interpolation2d == photo.interpolation2d
    for light in (linear, sharp):
        assert list(light.contrast_limits) == [0, 1]
        assert light.gamma == 1
        assert light.data.dtype == np.float32


@pytest.mark.parametrize("kind", PICTURES)
def test_results_have_the_shape_and_kind_of_number_of_the_photo(kind: str) -> None:
    session = opened(*PICTURES[kind])
    before = finest(session.photo).copy()
    restored = session.restore()
    assert restored.data.dtype == before.dtype
    assert restored.data.shape == before.shape
    np.testing.assert_array_equal(finest(session.photo), before)
    assert not np.shares_memory(restored.data, finest(session.photo))
    if before.shape[-1] == 4 and session.photo.rgb:
        np.testing.assert_array_equal(restored.data[..., 3], before[..., 3])


@pytest.mark.parametrize("kind", PICTURES)
def test_a_preview_lies_over_its_part_of_the_photo(kind: str) -> None:
    session = opened(*PICTURES[kind])
    photo = session.photo
    photo.corner_pixels = np.array(
        [[0] * (photo.ndim - 2) + [6, 11], [0] * (photo.ndim - 2) + [30, 40]]
    )
    region = visible_part(session.viewer, photo, 512)
    preview = session.preview()
    assert preview.data.shape[: photo.ndim] == tuple(axis.stop - axis.start for axis in region)
    assert preview.data.dtype == finest(photo).dtype
    assert list(preview.contrast_limits) == list(photo.contrast_limits)
    assert_in_place(preview, photo, region)


@pytest.mark.parametrize("verb", ["restore", "compare_with", "linearize"])
@pytest.mark.parametrize("kind", ["gray uint8", "RGBA uint8", "stack uint16", "multiscale"])
def test_a_part_lies_where_it_was_taken_from(kind: str, verb: str) -> None:
    session = opened(*PICTURES[kind])
    photo = session.photo
    region = (*[(1, 2)] * (photo.ndim - 2), (8, 31), (5, 50))
    layer = getattr(session, verb)(region=region)
    assert_in_place(layer, photo, tuple(slice(*pair) for pair in region))


def test_a_part_of_a_stack_is_that_slice() -> None:
    session = opened(*PICTURES["stack uint16"])
    whole = session.restore().data
    part = session.restore(region=[(1, 2), (0, ROWS), (0, COLUMNS)])
    np.testing.assert_array_equal(part.data, whole[1:2])


def test_a_preview_is_a_part_of_the_whole_result() -> None:
    session = opened(*PICTURES["RGB uint8"])
    session.photo.corner_pixels = np.array([[8, 12], [30, 44]])
    whole, preview = session.restore().data, session.preview().data
    # The rest is cut off some pixels beyond what the PSF reaches.
    difference = np.abs(whole[8:31, 12:45].astype(int) - preview)
    assert np.median(difference) <= 1


@pytest.mark.parametrize(
    "kind", ["gray uint8", "RGB float32", "multiscale", "stack uint16", "dask"]
)
def test_the_psf_lies_beside_the_photo_in_pixels_of_its_size(kind: str) -> None:
    session = opened(*PICTURES[kind])
    photo, layer = session.photo, session.viewer.layers["photo [PSF]"]
    assert layer.ndim == 2
    corner = [0] * photo.ndim
    for row, column in [(0, 0), (2, 3)]:
        there = layer.data_to_world((row, column))
        corner[-2:] = [row, column - PSF.shape[1] - 4]
        np.testing.assert_allclose(there, photo.data_to_world(corner)[-2:], atol=1e-9)
    assert layer.units == photo.units[-2:]
    assert layer.axis_labels == photo.axis_labels[-2:]
    assert layer.contrast_limits == [0, pytest.approx(PSF.max())]


def test_the_psf_is_seen_on_every_slice_of_a_stack() -> None:
    session = opened(*PICTURES["stack uint16"])
    layer = session.viewer.layers["photo [PSF]"]
    for plane in range(3):
        session.viewer.dims.set_current_step(0, plane)
        assert layer.get_value(
            (*session.viewer.dims.point[:1], *layer.data_to_world((2, 3))), world=True
        )


def test_another_psf_takes_the_place_of_the_first_in_its_layer() -> None:
    session = opened(*PICTURES["gray uint8"])
    layer = session.viewer.layers["photo [PSF]"]
    layer.name = "my PSF"
    session.set_psf(disk(6.2))
    assert [each.name for each in session.viewer.layers] == ["photo", "my PSF"]
    assert layer.data.shape == disk(6.2).shape
    right = layer.data_to_world((0, layer.data.shape[1] - 1))
    np.testing.assert_allclose(right, session.photo.data_to_world((0, -5)), atol=1e-9)


def test_layers_of_the_user_are_neither_replaced_nor_removed() -> None:
    viewer = ViewerModel()
    photo = viewer.add_image(*PICTURES["gray uint8"][:1], name="photo")
    labels = viewer.add_labels(np.zeros((3, 3), int), name="photo [PSF]")
    mine = viewer.add_image(np.zeros((3, 3)), name="photo [preview]")
    session = Session(viewer, photo)
    session.set_response(Gamma(2.2))
    session.set_psf(PSF)
    session.set_psf(PSF[::-1])
    session.preview()
    session.preview()
    assert labels.data.shape == mine.data.shape == (3, 3)
    assert [layer.name for layer in viewer.layers] == [
        "photo",
        "photo [PSF]",
        "photo [preview]",
        "photo [PSF] [1]",
        "photo [preview] [1]",
    ]


def test_names_are_unique() -> None:
    session = opened(*PICTURES["gray uint8"])
    session.restore()
    session.restore()
    names = [layer.name for layer in session.viewer.layers]
    assert len(set(names)) == len(names) == 10
    assert "photo [deblurred] [1]" in names


def test_a_stack_whose_slices_differ_is_refused_in_a_sentence() -> None:
    slices = [
        da.from_array(from_unit(gray((1, ROWS, COLUMNS)), kind)) for kind in (np.uint8, np.uint16)
    ]
    # What a lazy reader does that looks at the first file only.
    slices[1] = da.Array(slices[1].dask, slices[1].name, slices[1].chunks, dtype=np.uint8)
    session = opened(da.concatenate(slices), {"rgb": False})
    layers = len(session.viewer.layers)
    with pytest.raises(CrfDeblurError, match="says that it holds uint8, but this slice is uint16"):
        session.restore()
    assert len(session.viewer.layers) == layers
    assert session.state.linear is None


def test_what_lies_between_does_not_hide_the_photo(session: Session, blurred: Simulated) -> None:
    session.set_response(Gamma(1.8))
    session.set_psf(blurred.psf)
    session.restore()
    session.restore()
    session.compare_with()
    session.preview()
    for seen in ({"panels"}, {"panels", "panels [deblurred] [1]"}, {"panels"}):
        session.flip()
        visible = {layer.name for layer in session.viewer.layers if layer.visible}
        assert visible == seen | {"panels [PSF]"}


def test_what_is_compared_lies_below_the_result(session: Session, blurred: Simulated) -> None:
    session.set_response(Gamma(1.8))
    session.set_psf(blurred.psf)
    session.restore()
    session.compare_with()
    names = [layer.name for layer in session.viewer.layers]
    assert names[-2:] == ["panels [deblurred, gamma 2.2]", "panels [deblurred]"]


def test_before_and_after_take_turns(session: Session, blurred: Simulated) -> None:
    with pytest.raises(CrfDeblurError, match="restore it first"):
        session.flip()
    session.set_response(Gamma(1.8))
    session.set_psf(blurred.psf)
    restored = session.restore()
    for after in (False, True, False):
        session.flip()
        assert restored.visible is after
        assert session.photo.visible

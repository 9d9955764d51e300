"""Streaks, beads and paths that are drawn on a photo give its PSF."""

from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from napari.layers import Points, Shapes
from pytestqt.qtbot import QtBot
from scipy.signal import fftconvolve

from napari_crfdeblur import CrfDeblurError, Session
from napari_crfdeblur._napari.docks import BlurDock
from napari_crfdeblur.psf import Beads, MotionPath, PsfAt, PsfStatus, Streaks, camera_shake
from napari_crfdeblur.quality import kernel_similarity
from napari_crfdeblur.response import Identity

PSF = camera_shake(13, 4)
LAMPS = (30, 40, 0.7), (35, 130, 0.3), (96, 61, 0.5), (88, 151, 0.9)


@pytest.fixture
def session() -> Session:
    light = np.full((130, 190), 0.01)
    for row, column, peak in LAMPS:
        light[row, column] += peak / PSF.max()
    blurred = fftconvolve(light, PSF, mode="same")
    noisy = blurred + np.random.default_rng(1).normal(0, 0.002, blurred.shape)
    viewer = ViewerModel()
    photo = viewer.add_image(
        np.clip(noisy, 0, 1).astype(np.float32), name="night", scale=(2, 2), translate=(5, -3)
    )
    session = Session(viewer, photo)
    session.set_response(Identity())
    return session


def drawing(session: Session, kind: type, **values: Any) -> Any:
    """A layer over the photo, in its pixels."""
    layer = kind(scale=(2, 2), translate=(5, -3), **values)
    session.viewer.add_layer(layer)
    return layer


def test_points_are_beads(session: Session) -> None:
    places = [[row + 1, column - 1] for row, column, _ in LAMPS]
    found = session.use_drawn_psf(drawing(session, Points, data=places), size=27)
    assert kernel_similarity(found.psf, PSF) > 0.97
    assert found.diagnostics["beads"] == len(LAMPS)
    assert session.state.psf is found


def test_a_rectangle_is_a_box_around_a_streak(session: Session) -> None:
    layer = drawing(session, Shapes, data=[[[17, 27], [17, 53], [43, 53], [43, 27]]])
    found = session.use_drawn_psf(layer)
    assert kernel_similarity(found.psf, PSF) > 0.97
    method = session.state.sought.method
    assert method == PsfAt(30.0, 40.0, 27)


def test_a_path_is_the_motion_of_the_camera(session: Session) -> None:
    path = [[10, 10], [22, 10], [22, 15]]
    layer = drawing(session, Shapes, data=[path], shape_type="path")
    found = session.use_drawn_psf(layer)
    assert found.status is PsfStatus.GIVEN
    np.testing.assert_allclose(found.psf, MotionPath(tuple(map(tuple, path))).psf, atol=1e-12)


def test_what_is_drawn_is_found_again_from_the_record(session: Session) -> None:
    session.use_drawn_psf(drawing(session, Points, data=[[30, 40], [96, 61]]), size=27)
    before = session.state.psf.psf
    content = session.record()
    again = Session(ViewerModel(), None)
    again.viewer.add_image(session.photo.data, name="night")
    again.photo = again.viewer.layers[0]
    again.repeat(content)
    np.testing.assert_array_equal(again.state.psf.psf, before)


def test_nothing_drawn_is_refused_with_advice(session: Session) -> None:
    with pytest.raises(CrfDeblurError, match="nothing is drawn"):
        session.use_drawn_psf(drawing(session, Points, ndim=2))


def test_a_point_beside_the_photo_is_refused_with_advice(session: Session) -> None:
    with pytest.raises(CrfDeblurError, match="outside the photo"):
        session.use_drawn_psf(drawing(session, Points, data=[[-4, 20]]))


def test_places_are_those_of_the_whole_picture(session: Session) -> None:
    with pytest.raises(CrfDeblurError, match="leave out the region"):
        session.estimate_psf(Beads(((30, 40),), 27), region=((0, 60), (0, 90)))


def test_the_dock_offers_light_streaks_and_takes_what_is_drawn(
    qtbot: QtBot,  # noqa: ARG001 - widgets need Qt
    session: Session,
) -> None:
    dock = BlurDock(session.viewer)
    dock.photo = session.photo
    dock._method.chosen = "light streaks"
    assert dock._method.method == Streaks()
    assert kernel_similarity(dock.run().psf, PSF) > 0.97
    dock.draw_region().add_rectangles([[75, 138], [101, 164]])
    found = dock.begin(dock.pointing, block=True)
    assert found.diagnostics.keys() >= {"signal", "clipped"}

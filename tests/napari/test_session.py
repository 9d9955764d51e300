"""A session does what the library does, on layers, and loses nothing."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from napari.layers import Image

from napari_crfdeblur import CrfDeblurError, DeblurOptions, Session, deblur
from napari_crfdeblur._napari.session.state import Fitted
from napari_crfdeblur._napari.session.step import Level
from napari_crfdeblur._napari.session.way import way_of
from napari_crfdeblur.deconvolution import Wiener
from napari_crfdeblur.edges import Edge, Line
from napari_crfdeblur.estimate import (
    Finding,
    GivenResponse,
    MaximumLikelihood,
    RankMinimization,
    Responses,
    ResponseStatus,
)
from napari_crfdeblur.io import (
    record_from,
    to_record,
    write_edges,
    write_photo,
    write_psf,
    write_responses,
)
from napari_crfdeblur.pipeline import DEFAULT_METHOD, Stage
from napari_crfdeblur.pipeline.record import pixels_of
from napari_crfdeblur.psf import GivenPsf, RadonFit, RadonMap, delta, line
from napari_crfdeblur.response import SRGB, Cameras, Gamma, around
from napari_crfdeblur.simulate import Simulated

KEY = "napari-crfdeblur"
STEPS = ("detect_edges", "estimate_response", "linearize", "estimate_psf", "deconvolve", "reapply")


def given(session: Session) -> Session:
    """A response and a PSF that are there at once."""
    session.set_response(Gamma(1.8))
    session.set_psf(line(5, 0.3))
    return session


def test_the_verbs_give_what_the_library_gives(done: Session, blurred: Simulated) -> None:
    whole = deblur(blurred.photo)
    np.testing.assert_array_equal(done.state.restored.data, whole.photo)
    np.testing.assert_array_equal(done.state.linear.layer.data, whole.linear)
    np.testing.assert_array_equal(done.state.sharp.layer.data, whole.sharp_linear)
    np.testing.assert_array_equal(done.state.psf.psf, whole.psf.psf)
    assert done.state.edges.edges == whole.edges


def test_the_layers_are_named_after_the_photo(done: Session) -> None:
    assert [layer.name for layer in done.viewer.layers] == [
        "panels",
        "panels [edges]",
        "panels [linear]",
        "panels [PSF]",
        "panels [deblurred linear]",
        "panels [trust]",
        "panels [deblurred]",
    ]


def test_all_in_one_is_the_steps_one_by_one(done: Session, deblurred: Session) -> None:
    np.testing.assert_array_equal(deblurred.state.restored.data, done.state.restored.data)
    ways = [to_record(session.state.record.options) for session in (done, deblurred)]
    assert ways[0] == ways[1]
    assert done.state.record.result.same_as(deblurred.state.record.result)
    names = {layer.name for layer in deblurred.viewer.layers}
    assert names == {layer.name for layer in done.viewer.layers}


def test_all_in_one_takes_what_is_known(session: Session, blurred: Simulated) -> None:
    options = DeblurOptions(response=GivenResponse(Gamma(1.8)), psf=GivenPsf(blurred.psf))
    layer = session.deblur(options)
    np.testing.assert_array_equal(layer.data, deblur(blurred.photo, options).photo)
    assert session.state.edges is None
    used = replace(options, method=DEFAULT_METHOD)
    assert to_record(session.state.record.options) == to_record(used)


def test_all_in_one_uses_the_edges_that_are_there(edged: Session) -> None:
    kept = edged.state.edges.edges[:40]
    edged.set_edges(kept)
    edged.deblur(DeblurOptions(psf=GivenPsf(line(5, 0.3)), method=Wiener()))
    assert edged.state.fitted.edges.edges == kept


def test_a_psf_from_edges_alone_is_recorded_and_repeated(
    edged: Session, blurred: Simulated
) -> None:
    edged.set_edges([edge for edge in edged.state.edges.edges if edge.good])
    edged.set_response(Gamma(1.8))
    found = edged.estimate_psf(RadonFit(size=13))
    assert {"orientations", "gap"} <= set(found.diagnostics)
    assert edged.state.sought.method == RadonFit(size=13)
    assert "psf=RadonFit(size=13)" in edged.script()
    viewer = ViewerModel()
    other = Session(viewer, viewer.add_image(blurred.photo))
    other.repeat(json.loads(json.dumps(edged.record())))
    np.testing.assert_array_equal(other.state.psf.psf, found.psf)


def test_a_psf_from_picture_and_edges_is_recorded_and_repeated(
    edged: Session, blurred: Simulated
) -> None:
    edged.set_response(Gamma(1.8))
    found = edged.estimate_psf(RadonMap(size=13))
    assert found.diagnostics["profiles"] > 0
    viewer = ViewerModel()
    other = Session(viewer, viewer.add_image(blurred.photo))
    other.repeat(json.loads(json.dumps(edged.record())))
    np.testing.assert_array_equal(other.state.psf.psf, found.psf)


def test_a_psf_from_edges_is_that_of_their_slice(viewer: ViewerModel, blurred: Simulated) -> None:
    green = blurred.photo[..., 1]
    session = Session(viewer, viewer.add_image(np.stack([green, green[::-1, ::-1]])))
    session.set_response(Gamma(1.8))
    session.detect_edges(plane=(0,))
    first = session.estimate_psf(RadonFit(size=13))
    viewer.dims.set_current_step(0, 1)
    elsewhere = session.estimate_psf(RadonFit(size=13), region=((1, 2), (0, 50), (0, 50)))
    np.testing.assert_array_equal(elsewhere.psf, first.psf)


def test_all_in_one_can_find_the_psf_from_edges_alone(session: Session, blurred: Simulated) -> None:
    options = DeblurOptions(response=GivenResponse(Gamma(1.8)), psf=RadonFit(), method=Wiener())
    layer = session.deblur(options)
    np.testing.assert_array_equal(layer.data, deblur(blurred.photo, options).photo)
    used = replace(options, method=Wiener())
    assert to_record(session.state.record.options) == to_record(used)


@pytest.mark.parametrize("items", [None, ()], ids=["not looked for", "none left"])
def test_without_edges_a_psf_from_them_is_refused_and_nothing_changes(
    session: Session, items: tuple[()] | None
) -> None:
    given(session)
    if items is not None:
        session.set_edges(items, 8.0)
    before = session.state
    with pytest.raises(CrfDeblurError, match=r"find or draw (more )?edges"):
        session.estimate_psf(RadonFit())
    assert session.state is before


def test_the_input_is_never_changed(done: Session, blurred: Simulated) -> None:
    assert done.photo is done.viewer.layers["panels"]
    np.testing.assert_array_equal(done.photo.data, blurred.photo)
    assert done.photo.metadata == {}


def test_provenance_is_json_and_tells_the_whole_way(done: Session) -> None:
    record = json.loads(json.dumps(done.state.restored.metadata[KEY], allow_nan=False))
    assert record["source"]["name"] == "panels"
    again = record_from(record, "the layer")
    assert again.until is Stage.REAPPLY
    assert again.photo == pixels_of("panels", done.photo.data)
    assert again.result == pixels_of("panels", done.state.restored.data)
    assert len(record["edges"]["edges"]) == len(done.state.edges.edges)
    np.testing.assert_array_equal(record["psf"], done.state.psf.psf)
    estimate = done.state.fitted.estimates[0]
    assert record["response"]["channels"][0]["message"] == estimate.status.value
    assert {"scipy", "numpy", KEY} <= set(again.versions)


def test_provenance_of_the_linear_layer_ends_with_it(done: Session) -> None:
    record = done.state.linear.layer.metadata[KEY]
    assert record_from(record, "the layer").until is Stage.LINEAR
    assert record["psf"] is None


def test_a_saved_session_is_repeated_with_the_same_numbers(
    done: Session, blurred: Simulated, tmp_path: Path
) -> None:
    done.save(tmp_path / "session.json")
    viewer = ViewerModel()
    session = Session(viewer, viewer.add_image(blurred.photo, name="again"))
    said = session.repeat(tmp_path / "session.json")
    np.testing.assert_array_equal(session.state.restored.data, done.state.restored.data)
    assert said == ["the result is the same, pixel by pixel"]
    again = session.state.record
    assert to_record(again.options) == to_record(done.state.record.options)


def test_the_metadata_of_a_layer_can_be_repeated(session: Session, blurred: Simulated) -> None:
    restored = given(session).restore()
    viewer = ViewerModel()
    other = Session(viewer, viewer.add_image(blurred.photo))
    other.repeat(restored.metadata[KEY])
    np.testing.assert_array_equal(other.state.restored.data, restored.data)


def test_a_record_keeps_the_method_after_a_change(session: Session) -> None:
    given(session).restore(Wiener())
    session.set_response(Gamma(2.2))
    record = record_from(session.record(), "the session")
    assert record.options.method == Wiener()
    assert record.options.response == GivenResponse(Gamma(2.2))


@pytest.mark.parametrize("verb", ["restore", "linearize"])
def test_a_light_layer_can_be_repeated(session: Session, verb: str) -> None:
    getattr(given(session), verb)()
    light = session.state.linear.layer
    said = session.repeat(light.metadata[KEY])
    np.testing.assert_array_equal(session.state.linear.layer.data, light.data)
    same = "the result is the same, pixel by pixel"
    assert said == ([same] if verb == "linearize" else [])
    content = session.state.linear.layer.metadata[KEY]
    assert record_from(content, "the layer").result == pixels_of("panels", light.data)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "not a JSON file"),
        ("[1]", "give a record"),
        ('{"format": "crfdeblur-response"}', "give a record"),
        ('{"format": "crfdeblur-record", "version": 99}', "update"),
        ('{"format": "crfdeblur-record", "version": 1, "record": 3}', "damaged"),
        ('{"format": "crfdeblur-record", "version": 1}', "damaged"),
        (
            '{"format": "crfdeblur-record", "version": 1, "record": {"type": "os.system"}}',
            "not known",
        ),
        (
            '{"format": "crfdeblur-record", "version": 1, "record": {"type": "Record", '
            '"restore_into": "out.tif"}}',
            "expected the fields",
        ),
    ],
)
def test_a_bad_session_file_is_refused_in_a_sentence(
    session: Session, tmp_path: Path, content: str, said: str
) -> None:
    path = tmp_path / "session.json"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(CrfDeblurError, match=said):
        session.repeat(path)
    assert session.state.found == (None,) * 4


def test_a_step_without_its_need_says_what_to_do(session: Session) -> None:
    for verb, said in (
        ("estimate_response", "edges"),
        ("linearize", "response"),
        ("estimate_psf", "response"),
        ("deconvolve", "PSF"),
        ("reapply", "deconvolve first"),
        ("restore", "response"),
        ("undo_edges", "undo"),
        ("flip", "restore it first"),
    ):
        with pytest.raises(CrfDeblurError, match=said):
            getattr(session, verb)()
    assert [layer.name for layer in session.viewer.layers] == ["panels"]


def test_without_a_photo_every_verb_says_so(viewer: ViewerModel) -> None:
    session = Session(viewer)
    for verb in (*STEPS, "deblur", "record"):
        with pytest.raises(CrfDeblurError, match="no photo yet"):
            getattr(session, verb)()


@pytest.mark.parametrize(
    ("add", "said"),
    [
        (lambda v: v.add_labels(np.ones((20, 30), dtype=int), name="cells"), "Labels layer"),
        (lambda v: v.add_points(np.ones((3, 2)), name="dots"), "Points layer"),
        (lambda v: v.add_image(np.zeros((0, 9, 9)), contrast_limits=(0, 1)), "rows and columns"),
    ],
)
@pytest.mark.filterwarnings("ignore:(invalid|divide):RuntimeWarning")
def test_what_is_no_photo_is_refused_in_a_sentence(
    viewer: ViewerModel, add: Any, said: str
) -> None:
    layer = add(viewer)
    with pytest.raises(CrfDeblurError, match=said):
        Session(viewer, layer)


@pytest.mark.parametrize(
    ("pixels", "said"),
    [
        (np.full((30, 40), 7, dtype=np.int32), "white level"),
        (np.zeros((30, 40), dtype=bool), "white level"),
        (np.full((30, 40), np.nan, dtype=np.float32), "not finite"),
        (np.linspace(0, 300, 1200, dtype=np.float32).reshape(30, 40), "full scale"),
        (np.full((30, 40), 255, dtype=np.uint8), "saturated"),
        (np.ones((3, 4), dtype=np.uint8), "at least 8"),
    ],
)
def test_a_bad_photo_is_refused_in_a_sentence_and_nothing_changes(
    viewer: ViewerModel, pixels: np.ndarray, said: str
) -> None:
    session = Session(viewer, viewer.add_image(pixels, contrast_limits=(0, 1)))
    with pytest.raises(CrfDeblurError, match=said):
        session.deblur()
    assert session.state.found == (None,) * 4
    assert len(viewer.layers) == 1


def test_a_white_level_makes_any_numbers_a_photo(viewer: ViewerModel, blurred: Simulated) -> None:
    green = blurred.photo[..., 1]
    session = Session(viewer, viewer.add_image(green.astype(np.int32)), white=255)
    layer = given(session).restore()
    reference = given(Session(ViewerModel(), Image(green))).restore()
    assert layer.data.dtype == np.int32
    # The same light to float32, whose rounding can tip a detail over the prior's threshold, and
    # with it its neighbors.
    off = np.abs(layer.data - reference.data.astype(int))
    assert (off == 0).mean() > 0.95
    assert off.max() <= 8
    assert record_from(layer.metadata[KEY], "the layer").white == 255


@pytest.mark.parametrize("white", [0, -1, np.nan, np.inf])
def test_a_senseless_white_level_is_refused(session: Session, white: float) -> None:
    with pytest.raises(ValueError, match="positive white level"):
        session.white = white
    assert session.white is None


def test_undo_and_redo_go_through_all_changes_of_the_edges(edged: Session) -> None:
    session = edged
    found = session.state.edges
    session.remove_edges([0, 2])
    removed = session.state.edges
    assert len(removed.edges) == len(found.edges) - 2
    session.undo_edges()
    assert session.state.edges is found
    session.undo_edges()
    assert session.state.edges is None
    session.redo_edges()
    session.redo_edges()
    assert session.state.edges is removed
    with pytest.raises(CrfDeblurError, match="redo"):
        session.redo_edges()


def test_edges_are_taken_as_they_are_and_lines_are_refined(edged: Session) -> None:
    session = edged
    good = next(edge for edge in session.state.edges.edges if edge.good)
    shifted = Line((good.start[0] + 1, good.start[1] + 1), (good.end[0] + 1, good.end[1] + 1))
    found = session.set_edges([good, shifted])
    assert found.edges[0] == good
    assert isinstance(found.edges[1], Edge)
    turned = found.edges[1].orientation - good.orientation  # the same after half a turn
    assert np.sin(turned) == pytest.approx(0, abs=0.02)
    middle = np.mean([found.edges[1].start, found.edges[1].end], axis=0)
    assert abs((middle - good.start) @ good.normal) < 0.3


def test_detected_edges_can_be_added_to_those_there_are(edged: Session) -> None:
    session = edged
    found = session.state.edges.edges
    session.set_edges(found[:2])
    session.detect_edges(add=True)
    assert session.state.edges.edges == (*found[:2], *found)


def test_only_the_last_of_edges_set_one_after_the_other_is_recorded(session: Session) -> None:
    session.detect_edges(12.0)
    options = way_of(session.state).options
    assert (options.edges, options.blur_extent) == (None, 12.0)
    for count in (5, 4, 3):
        session.set_edges(session.state.edges.edges[:count])
    assert way_of(session.state).options.edges == session.state.edges.edges
    assert len(session.state.edges.edges) == 3


def test_files_go_in_and_out(edged: Session, tmp_path: Path) -> None:
    session = edged
    write_edges(tmp_path / "edges.json", session.state.edges.edges)
    write_responses(tmp_path / "response.json", [GivenResponse(SRGB()).estimate()])
    write_psf(tmp_path / "psf.npy", line(7, 0.4))
    session.load_edges(tmp_path / "edges.json")
    session.load_response(tmp_path / "response.json")
    session.load_psf(tmp_path / "psf.npy")
    levels = np.linspace(0, 1, 33)
    curve = session.state.fitted.curve
    # The file holds 257 samples of the curve.
    np.testing.assert_allclose(curve.to_irradiance(levels), SRGB().to_irradiance(levels), atol=2e-5)
    np.testing.assert_allclose(session.state.psf.psf, line(7, 0.4), atol=1e-12)


def test_a_response_of_another_format_is_refused(session: Session, tmp_path: Path) -> None:
    write_edges(tmp_path / "edges.json", [Edge((1, 1), (9, 30))])
    with pytest.raises(CrfDeblurError, match="not a response file"):
        session.load_response(tmp_path / "edges.json")
    assert session.state.fitted is None


def test_photos_of_one_camera_are_pooled(
    edged: Session, blurred: Simulated, tmp_path: Path
) -> None:
    session = edged
    write_photo(tmp_path / "other.png", blurred.photo[74::-1])
    layer = session.viewer.add_image(blurred.photo[75:, ::-1], name="mirrored")
    alone = session.estimate_response()
    pooled = session.estimate_response(others=[layer, tmp_path / "other.png"])
    images = {source.image for group in pooled.groups for source in group.sources}
    assert images == {0, 1, 2}
    assert sum(map(len, pooled.groups)) > sum(map(len, alone.groups))
    with pytest.raises(CrfDeblurError, match=r"missing\.png"):
        session.estimate_response(others=[tmp_path / "missing.png"])
    assert session.state.fitted is pooled


def test_each_channel_can_have_its_own_curve(edged: Session) -> None:
    assert len(edged.estimate_response(per_channel=True).estimates) == 3


@pytest.mark.parametrize(
    "fit",
    [
        None,
        MaximumLikelihood(Cameras.SRGB),
        MaximumLikelihood(psf=line(5, 0.3)),
        MaximumLikelihood(around(SRGB())),
        RankMinimization(),
    ],
    ids=["default", "kind", "PSF", "near a curve", "paper"],
)
def test_how_the_response_was_found_is_recorded_and_repeated(edged: Session, fit: Any) -> None:
    few = [edge for edge in edged.state.edges.edges if edge.good][:6]
    edged.set_edges(few)
    curve = edged.estimate_response(fit).curve
    record = json.loads(json.dumps(edged.record()))
    assert record["record"]["options"]["response"] == to_record(fit or MaximumLikelihood())
    edged.set_response(Gamma(3.0))
    edged.repeat(record)
    levels = np.linspace(0, 1, 65)
    again = edged.state.fitted.curve.to_irradiance(levels)
    np.testing.assert_array_equal(again, curve.to_irradiance(levels))


@pytest.mark.parametrize("status", ResponseStatus)
def test_trust_in_a_response_is_said_with_the_first_reasons(
    session: Session, fitted: Fitted, status: ResponseStatus
) -> None:
    said: list[Any] = []
    session.said.connect(said.append)
    estimate = replace(fitted.estimates[0], status=status, findings=tuple(Finding))
    session.say_trust(Fitted(Responses((estimate,))))
    first, *why = said[-1].text.split("\n")
    assert first == f"response: {status.value}"
    assert 0 < len(why) < len(Finding)
    assert all(finding.value in line for finding, line in zip(Finding, why, strict=False))
    trusted = status in (ResponseStatus.GOOD, ResponseStatus.GIVEN)
    assert said[-1].level is (Level.INFO if trusted else Level.DOUBT)


def test_each_photo_keeps_what_is_known_of_it(session: Session, blurred: Simulated) -> None:
    given(session)
    first, known = session.photo, session.state
    session.photo = session.viewer.add_image(blurred.photo[::-1], name="second")
    assert session.state.fitted is None
    session.photo = first
    assert session.state is known


def test_a_photo_that_is_closed_is_let_go_and_the_next_one_taken(session: Session) -> None:
    said = []
    session.said.connect(lambda message: said.append(message.text))
    session.viewer.layers.remove(session.photo)
    assert session.photo is None
    assert "panels" in said[-1]
    session.viewer.add_image(np.zeros((20, 30), dtype=np.uint8), name="next")
    assert session.photo.name == "next"


def test_docks_of_one_viewer_share_a_session_and_viewers_do_not(viewer: ViewerModel) -> None:
    assert Session.of(viewer) is Session.of(viewer)
    assert Session.of(ViewerModel()) is not Session.of(viewer)


def test_the_restored_photo_can_be_compared_with_gamma(session: Session) -> None:
    given(session).restore()
    before = session.state.restored
    layer = session.compare_with()
    assert layer.name == "panels [deblurred, gamma 2.2]"
    assert session.state.restored is before
    assert not np.array_equal(layer.data, before.data)
    same = session.compare_with(Gamma(1.8))
    np.testing.assert_array_equal(same.data, before.data)


def test_flip_shows_the_photo_and_the_result_in_turn(session: Session) -> None:
    restored = given(session).restore()
    session.flip()
    assert not restored.visible
    session.flip()
    assert restored.visible


def test_a_preview_is_shown_in_place_and_equals_the_whole(session: Session) -> None:
    given(session)
    whole = session.restore()
    first = session.preview()
    second = session.preview()
    previews = [layer for layer in session.viewer.layers if "preview" in layer.name]
    assert previews == [second]
    assert first is not second
    assert second.data.dtype == whole.data.dtype
    np.testing.assert_array_equal(second.data, whole.data)


def test_many_layers_are_restored_and_a_bad_one_is_passed_over(
    session: Session, blurred: Simulated
) -> None:
    given(session)
    reference = session.restore()
    same = session.viewer.add_image(blurred.photo, name="same")
    bad = session.viewer.add_image(np.full((40, 50), np.nan, np.float32), contrast_limits=(0, 1))
    result = session.restore_layers([bad, same])
    assert list(result.done) == ["same"]
    np.testing.assert_array_equal(result.done["same"].data, reference.data)
    assert "not finite" in result.failed[bad.name]


def test_many_files_are_restored_and_a_bad_one_is_passed_over(
    session: Session, blurred: Simulated, tmp_path: Path
) -> None:
    given(session)
    write_photo(tmp_path / "good.png", blurred.photo)
    (tmp_path / "bad.png").write_bytes(b"no picture")
    paths = [tmp_path / "bad.png", tmp_path / "good.png", tmp_path / "missing.png"]
    result = session.restore_files(paths, tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").glob("*.png")] == ["good-deblurred.png"]
    assert set(result.failed) == {"bad.png", "missing.png"}
    assert "1 of 3" in result.sentence


def test_no_blur_and_no_response_restore_the_photo_itself(session: Session) -> None:
    session.set_response(Gamma(1.0))
    session.set_psf(delta())
    restored = session.restore()
    # The prior may smooth what it takes for noise, and no more.
    assert np.abs(restored.data.astype(int) - session.photo.data).mean() < 1.5

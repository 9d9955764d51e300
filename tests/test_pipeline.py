"""The whole path, from a photo of known truth."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur import CrfDeblurError, DeblurOptions, deblur, find_edges
from napari_crfdeblur.deconvolution import HyperLaplacian, Wiener, deconvolve
from napari_crfdeblur.edges import estimating_blur_extent, finding_edges, refining_edges
from napari_crfdeblur.estimate import (
    Finding,
    GivenResponse,
    PerChannel,
    RankMinimization,
    ResponseStatus,
    estimating_responses,
)
from napari_crfdeblur.estimate.paper.fitting import PolynomialFit
from napari_crfdeblur.pipeline import (
    PATH,
    Intermediates,
    Stage,
    deblurring,
    edges_needed,
    profiles_for,
    profiling,
    suited_estimator,
    walking,
)
from napari_crfdeblur.profiles import sampling_profiles
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import (
    GivenPsf,
    Portfolio,
    PsfEstimate,
    PsfField,
    PsfStatus,
    RadonFit,
    RadonMap,
    XuJia,
    camera_shake,
)
from napari_crfdeblur.quality import kernel_similarity, psnr, response_error
from napari_crfdeblur.response import SRGB, Cameras, Gamma, GeneralizedGamma, linearize
from napari_crfdeblur.simulate import Camera, Scene, camera_turn, simulate, slanted_edges

RESPONSE = GeneralizedGamma((0.85, -0.75, 0.25))
QUICK = RankMinimization(polynomial=PolynomialFit(resamples=0))
KNOWN = DeblurOptions(response=GivenResponse(SRGB()), psf=GivenPsf(camera_shake(9, 1)))
OTHERS = PsfField(np.ones((1, 2, 3, 5)), ((PsfStatus.GOOD,) * 2,), (21, 30))


@pytest.fixture(scope="module")
def truth():
    psf = camera_shake(13, 4)
    scene = slanted_edges((252, 372), seed=3, pitch=125, channels=3)
    return simulate(scene, psf, Camera(RESPONSE, noise=0.002), seed=5)


@pytest.fixture(scope="module")
def found(truth):
    """The edges of that photo."""
    return find_edges(truth.photo, blur_extent=17)


@pytest.fixture(scope="module")
def estimated(truth):
    """That photo, restored with the response that its edges tell."""
    psf = GivenPsf(truth.psf)
    return deblur(truth.photo, DeblurOptions(response=QUICK, psf=psf, blur_extent=17))


@pytest.fixture(scope="module")
def small():
    """A small photo in color; odd and unequal sides."""
    return np.random.default_rng(0).random((45, 61, 3))


@pytest.fixture(scope="module")
def restored(small):
    """That photo, restored along the whole path."""
    return deblur(small, KNOWN).photo


def test_an_estimated_response_restores_better_than_an_assumed_one(truth, estimated):
    psf = GivenPsf(truth.psf)
    options = {
        "gamma": DeblurOptions(response=GivenResponse(Gamma(2.2)), psf=psf),
        "true": DeblurOptions(response=GivenResponse(RESPONSE), psf=psf),
    }
    results = {name: deblur(truth.photo, option) for name, option in options.items()}
    results["estimated"] = estimated
    quality = {name: psnr(result.photo, truth.sharp) for name, result in results.items()}
    estimate = estimated.responses[0]
    # The clean edges of this scene determine the response to a fraction of gamma's error, .03.
    assert response_error(estimate.curve, RESPONSE, estimate.covered) < 0.006
    assert quality["estimated"] > quality["gamma"] + 1
    assert quality["estimated"] > quality["true"] - 0.5


def test_all_intermediates_are_kept(truth, estimated):
    assert any(edge.good for edge in estimated.edges)
    assert estimated.groups
    assert estimated.linear.shape == estimated.sharp_linear.shape == truth.photo.shape
    assert estimated.photo.dtype == truth.photo.dtype
    assert 0 <= estimated.clipped < 0.5


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32, np.float64])
@pytest.mark.parametrize("channels", [(), (3,), (4,)])
def test_the_result_has_the_shape_and_kind_of_the_photo(dtype, channels):
    unit = np.random.default_rng(1).random((45, 61, *channels))
    scale = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    photo = (unit * scale).astype(dtype)
    before = photo.copy()
    result = deblur(photo, KNOWN).photo
    assert result.shape == photo.shape
    assert result.dtype == dtype
    assert np.array_equal(photo, before)
    assert 0 <= result.min() <= result.max() <= scale


def test_alpha_is_kept():
    photo = np.random.default_rng(2).integers(0, 255, (45, 61, 4), dtype=np.uint8)
    assert np.array_equal(deblur(photo, KNOWN).photo[..., 3], photo[..., 3])


def test_no_edges_are_sought_when_response_and_psf_are_known(small):
    result = deblur(small, KNOWN)
    assert result.edges == ()
    assert result.groups == ()


def test_each_channel_can_have_its_own_response(small):
    curves = (SRGB(), Gamma(1.5), Gamma(3.0))
    options = DeblurOptions(
        response=PerChannel(tuple(map(GivenResponse, curves))),
        psf=GivenPsf(np.ones((1, 1))),
        method=Wiener(),
    )
    result = deblur(small, options)
    for channel, curve in enumerate(curves):
        expected = curve.to_irradiance(small[..., channel])
        assert np.allclose(result.linear[..., channel], expected)


def test_edges_drawn_by_the_user_are_the_ones_used(truth):
    lines = [edge.line for edge in truth.edges[:6]]
    options = DeblurOptions(edges=lines, blur_extent=17)
    edges = drain(profiling(truth.photo, options)).edges
    assert len(edges) == len(lines)
    for edge, line in zip(edges, lines, strict=True):
        ends = np.array([edge.start, edge.end])
        drawn = np.array([line.start, line.end])
        along = (drawn[1] - drawn[0]) / np.linalg.norm(drawn[1] - drawn[0])
        across = (ends - drawn[0]) @ np.array([-along[1], along[0]])
        # An edge is located to .1 px where it is good; a bad one stays near where it was drawn.
        assert np.abs(across).max() < (1 if edge.good else 17)


def test_gray_photos_are_grouped_by_orientation():
    scene = slanted_edges((252, 372), seed=3, pitch=125)
    photo = simulate(scene, camera_shake(13, 4), Camera(RESPONSE), seed=5).photo
    edges = find_edges(photo, blur_extent=17)
    groups = profiles_for(QUICK, photo, edges)
    assert max(len({s.edge for s in group.sources}) for group in groups) > 1


def test_progress_names_the_stages_in_order(small):
    stages = []
    job = deblurring(small, KNOWN)
    for progress in job:
        assert 0 <= progress.done <= max(progress.total, 1)
        if progress.stage not in stages:
            stages.append(progress.stage)
    assert len(stages) >= 3


def test_a_stopped_job_gives_nothing(small):
    job = deblurring(small, KNOWN)
    next(job)
    job.close()
    with pytest.raises(StopIteration):
        next(job)


def test_the_search_for_edges_and_profiles_reports_and_can_be_stopped(truth, found):
    lines = [edge.line for edge in truth.edges]
    for job in (
        finding_edges(truth.photo, blur_extent=17),
        estimating_blur_extent(truth.photo),
        refining_edges(truth.photo, lines, blur_extent=17),
        sampling_profiles(truth.photo, found),
        walking(Intermediates(truth.photo, edges=found), DeblurOptions(), until=Stage.PROFILES),
    ):
        reports = [next(job) for _ in range(5)]
        assert all(0 <= report.done < report.total for report in reports)
        job.close()
        with pytest.raises(StopIteration):
            next(job)


def test_a_job_reports_every_edge_and_never_goes_back(truth, found):
    lines = [edge.line for edge in truth.edges]
    for job, least in (
        (refining_edges(truth.photo, lines, blur_extent=17), len(lines)),
        (sampling_profiles(truth.photo, found), 2 * sum(edge.good for edge in found)),
    ):
        reports = []
        drain(job, reports.append)
        done = [report.done for report in reports]
        assert done == sorted(done)
        assert len({(report.stage, report.total) for report in reports}) == 1
        assert len(reports) >= 0.9 * least  # edges of which no channel is usable end early
        assert done[-1] <= reports[-1].total


@pytest.mark.parametrize(
    ("photo", "advice"),
    [
        (np.zeros((0, 5)), "at least 8"),
        (np.zeros((1, 1), dtype=np.uint8), "at least 8"),
        (np.full((40, 50), 77, dtype=np.uint8), "constant"),
        (np.full((40, 50, 3), 255, dtype=np.uint8), "shorter exposure"),
        (np.full((40, 50), np.nan), "finite"),
        (np.where(np.eye(40, 50), np.inf, 0.5), "finite"),
        (np.linspace(0, 4095, 2000).reshape(40, 50), "full scale"),
    ],
    ids=["empty", "pixel", "constant", "saturated", "nan", "infinite", "range"],
)
def test_a_photo_that_cannot_be_deblurred_is_refused_with_advice(photo, advice):
    with pytest.raises(CrfDeblurError, match=advice):
        deblur(photo, DeblurOptions(psf=GivenPsf(np.ones((3, 3)))))


def test_a_psf_larger_than_the_photo_is_refused(small):
    options = DeblurOptions(response=GivenResponse(SRGB()), psf=GivenPsf(np.ones((99, 3))))
    with pytest.raises(CrfDeblurError, match="larger than the image"):
        deblur(small, options)


def test_without_an_edge_the_response_is_what_is_assumed_of_cameras():
    photo = np.random.default_rng(0).integers(90, 99, (80, 90), dtype=np.uint8)
    result = deblur(photo, DeblurOptions(psf=GivenPsf(camera_shake(5, 1))))
    (estimate,) = result.responses
    assert estimate.status is ResponseStatus.CANNOT_TELL
    assert estimate.findings == (Finding.NO_EDGES,)
    assert estimate.covered == (0.0, 0.0)
    intensity = np.linspace(0, 1, 33)
    assumed = Cameras.DIGITAL.prior.curve()
    np.testing.assert_array_equal(
        estimate.curve.to_irradiance(intensity), assumed.to_irradiance(intensity)
    )
    assert result.photo.shape == photo.shape


def test_the_psf_can_be_measured_on_the_edges_alone(truth):
    options = DeblurOptions(response=GivenResponse(RESPONSE), psf=RadonFit(size=13), blur_extent=17)
    found = drain(walking(Intermediates(truth.photo), options, until=Stage.FIELD))
    assert any(edge.good for edge in found.edges)
    # With edges of a few orientations; one that is round and as wide reaches .6.
    assert kernel_similarity(found.psf.psf, truth.psf) > 0.8


def test_the_psf_can_be_found_in_the_picture_and_its_edges(truth):
    options = DeblurOptions(response=GivenResponse(RESPONSE), psf=RadonMap(size=13), blur_extent=17)
    found = drain(walking(Intermediates(truth.photo), options, until=Stage.FIELD))
    assert found.psf.diagnostics["profiles"] > 0
    assert kernel_similarity(found.psf.psf, truth.psf) > 0.95


def test_without_edges_the_picture_alone_tells_the_psf(truth):
    options = DeblurOptions(response=GivenResponse(RESPONSE), psf=RadonMap(size=13), edges=())
    found, alone = (
        drain(walking(Intermediates(truth.photo), replace(options, psf=psf), until=Stage.PSF))
        for psf in (RadonMap(size=13), XuJia(size=13))
    )
    assert found.psf.diagnostics["profiles"] == 0
    np.testing.assert_array_equal(found.psf.psf, alone.psf.psf)


def test_a_scene_of_one_common_range_cannot_tell_the_response():
    stripes = (np.arange(400) // 50 % 2 * 0.5 + 0.2).astype(np.float32)
    scene = Scene(np.repeat(stripes[None], 120, axis=0))
    photo = simulate(scene, camera_shake(9, 2), Camera(RESPONSE, noise=0.001), seed=1).photo
    options = DeblurOptions(psf=GivenPsf(np.ones((3, 3))), blur_extent=12, method=HyperLaplacian())
    (estimate,) = deblur(photo, options).responses
    assert estimate.status in (ResponseStatus.CANNOT_TELL, ResponseStatus.DOUBTFUL)
    assert Finding.ALIKE in estimate.findings


@pytest.fixture(scope="module")
def turned():
    shape = (180, 250)
    scene = slanted_edges(shape, seed=1, pitch=45, channels=3)
    motion = camera_turn(9, 0.02, 4, shape)
    return simulate(scene, motion, Camera(SRGB(), noise=0.002), seed=2)


def test_a_psf_for_every_part_restores_a_turned_photo_better(turned):
    response, psf, method = GivenResponse(SRGB()), XuJia(size=15), HyperLaplacian()
    known = DeblurOptions(response=response, psf=psf, method=method)
    one = deblur(turned.photo, known)
    parts = deblur(turned.photo, replace(known, regions=3))
    assert one.field is None
    assert parts.field.grid == (2, 3)
    assert np.array_equal(parts.psf.psf, one.psf.psf)
    assert psnr(parts.photo, turned.sharp) > psnr(one.photo, turned.sharp) + 0.5


def test_a_given_psf_can_vary_too(turned):
    options = DeblurOptions(
        response=GivenResponse(SRGB()), psf=GivenPsf(turned.psf), regions=2, blur_extent=12
    )
    found = drain(walking(Intermediates(turned.photo), options, until=Stage.FIELD))
    assert found.psf.status is PsfStatus.GIVEN
    assert found.field.grid == (1, 2)


def test_saturated_pixels_go_to_both_halves_of_the_path(turned):
    photo = turned.photo.copy()
    photo[20:24, 30:40] = 255
    options = DeblurOptions(response=GivenResponse(SRGB()), psf=GivenPsf(turned.psf))
    found = drain(walking(Intermediates(photo), options, until=Stage.FIELD))
    assert found.clipped.shape == photo.shape
    assert found.clipped[20:24, 30:40].all()


def test_the_size_of_the_psf_needs_no_edges(small):
    have, known = Intermediates(small), DeblurOptions(response=GivenResponse(SRGB()))
    assert not edges_needed(have, known)
    assert edges_needed(have, replace(known, psf=RadonFit()))
    assert suited_estimator(small, None) == Portfolio()
    assert suited_estimator(small, 8.0).size == 13
    assert suited_estimator(small, 80.0).size == 15  # a third of the shorter side


STAGES = list(Stage)


def test_every_stage_adds_its_product_and_the_observer_sees_them_in_order(small):
    seen = []

    def look(stage, have):
        assert stage.is_done(have) or stage is Stage.FIELD  # one PSF serves the whole
        assert not any(later.is_done(have) for later in STAGES[STAGES.index(stage) + 1 :])
        seen.append(stage)

    drain(deblurring(small, KNOWN, observe=look))
    assert seen == STAGES


@pytest.mark.parametrize("last", STAGES)
def test_the_path_can_stop_at_any_stage_and_go_on_from_there(small, restored, last):
    half = drain(walking(Intermediates(small), KNOWN, until=last))
    assert [stage for stage in STAGES if stage.is_done(half)] == [
        stage for stage in STAGES[: STAGES.index(last) + 1] if stage is not Stage.FIELD
    ]
    assert np.array_equal(drain(walking(half, KNOWN)).result, restored)


def test_a_stage_is_skipped_where_its_product_is_there(small):
    light = np.full(small.shape, 0.25, dtype=np.float32)
    have = drain(walking(Intermediates(small, linear=light), KNOWN))
    assert have.linear is light
    assert np.allclose(have.sharp_linear, 0.25, atol=1e-3)


def test_a_stage_can_be_replaced(small):
    def copy(have, options):  # noqa: ARG001 - every stage takes both
        yield from ()
        return replace(have, sharp_linear=have.linear)

    have = drain(walking(Intermediates(small), KNOWN, replaced={Stage.RESTORE: copy}))
    assert np.allclose(have.result, small, atol=2e-3)
    assert PATH[Stage.RESTORE] is not copy


@pytest.mark.parametrize(
    "wrong",
    [
        {"response": "auto"},
        {"response": [GivenResponse(SRGB())] * 3},
        {"psf": np.ones((3, 3))},
        {"psf": Wiener()},
        {"method": "wiener"},
        {"edges": [(1, 2)]},
        {"edges": "edges"},
        {"blur_extent": 0},
        {"blur_extent": -3.0},
        {"blur_extent": np.nan},
        {"blur_extent": np.inf},
        {"blur_extent": "5"},
        {"blur_extent": True},
        {"regions": 0},
        {"regions": (2, -1)},
        {"regions": (2, 2, 2)},
        {"regions": 1.5},
        {"regions": True},
    ],
    ids=str,
)
def test_options_that_cannot_be_are_refused_where_they_are_made(wrong):
    with pytest.raises(ValueError, match=r"expected .*, got"):
        DeblurOptions(**wrong)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"regions": (46, 2)}, "parts"),
        ({"regions": 62}, "parts"),
        ({"blur_extent": 1e6}, "wider than the photo"),
        ({"psf": GivenPsf(np.ones((3, 5)), OTHERS)}, "a picture of 30 x 21 pixels"),
    ],
    ids=["rows", "longer side", "extent", "parts of another"],
)
def test_options_beyond_the_photo_are_refused_before_any_work(small, options, said):
    seen = []
    job = deblurring(small, replace(KNOWN, **options), observe=lambda *stage: seen.append(stage))
    with pytest.raises(CrfDeblurError, match=said):
        drain(job)
    assert not seen


def test_responses_of_three_channels_do_not_fit_a_gray_photo(small):
    options = replace(KNOWN, response=PerChannel.alike(GivenResponse(SRGB())))
    with pytest.raises(CrfDeblurError, match="3 responses"):
        deblur(small[..., 0], options)


def test_a_volume_goes_along_the_same_path():
    stack = np.random.default_rng(3).uniform(0, 0.9, (9, 21, 30)).astype(np.float32)
    psf = np.zeros((3, 3, 5))
    psf[0, 1, 2], psf[1, 1, 1:4], psf[2, 2, 2] = 0.2, 0.2, 0.2
    response = drain(estimating_responses([], GivenResponse(Gamma(2.0))))
    start = Intermediates(stack, axes=3, response=response, psf=PsfEstimate(psf, PsfStatus.GIVEN))
    have = drain(walking(start, DeblurOptions(method=Wiener())))
    linear = linearize(stack.reshape(-1, 30), Gamma(2.0)).reshape(stack.shape)
    expected = deconvolve(linear, psf, Wiener())
    assert np.array_equal(have.sharp_linear, expected)
    assert have.result.shape == stack.shape

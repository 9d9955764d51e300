"""Records of methods, curves, edges and results: JSON and back, and what is refused."""

import json
from dataclasses import fields, is_dataclass
from enum import StrEnum
from importlib import import_module
from inspect import isabstract
from math import inf, nan
from pathlib import Path
from pkgutil import iter_modules

import numpy as np
import pytest

from napari_crfdeblur.deconvolution import (
    Deconvolver,
    Guarded,
    HyperLaplacian,
    Judged,
    LightNoise,
    LocalShrinkage,
    PlaneStatistics,
    RichardsonLucy,
    SparseIrls,
    Strengthened,
    Swing,
    Tiled,
    TotalVariation,
    Trust,
    Verdict,
    Wiener,
)
from napari_crfdeblur.edges import Edge, EdgeStatus, Line, Rectangle
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import (
    Finding,
    GivenResponse,
    KnownPsf,
    MaximumLikelihood,
    MeanProfile,
    NoiseModel,
    PerChannel,
    PolynomialFit,
    RankMinimization,
    ResponseEstimate,
    ResponseFit,
    ResponseStatus,
    RowScale,
    Tail,
)
from napari_crfdeblur.io import from_record, to_record
from napari_crfdeblur.io.records import MEMBERS, STAGES
from napari_crfdeblur.pipeline import DeblurOptions, Pixels, Record, Stage
from napari_crfdeblur.profiles import (
    Alignment,
    ByEdge,
    ByOrientation,
    ByPolarity,
    Channels,
    CommonShape,
    EndPoints,
    Grouping,
    ProfileGroup,
    ProfileSource,
)
from napari_crfdeblur.psf import (
    Beads,
    Fergus,
    GivenPsf,
    L0Gradient,
    MinimalPixels,
    MotionPath,
    Portfolio,
    Poses,
    PsfAt,
    PsfEstimate,
    PsfEstimator,
    PsfField,
    PsfStatus,
    RadonFit,
    RadonMap,
    Shan,
    Streaks,
    Variational,
    XuJia,
)
from napari_crfdeblur.response import (
    SRGB,
    Cameras,
    Emor,
    Gamma,
    GeneralizedGamma,
    Identity,
    Polynomial,
    ResponseCurve,
    ResponsePrior,
    Tabulated,
    Tuned,
    around,
)

PACKAGE = "napari_crfdeblur."
RANDOM = np.random.default_rng(8)
KERNEL = RANDOM.random((3, 5))
TABLE = Tabulated(np.array([0, 0.1, 1 / 3, 1]), np.array([0, 0.35, 0.8, 1]))
LEVELS = np.linspace(0, 1, 5)
PRIOR = ResponsePrior(around(TABLE).mean, RANDOM.random((3, 1)) * around(Gamma(1.7)).directions[:3])
NOISE = NoiseModel(floor=1e-3, mismatch=0.01, freedom=3.0)
FIT = PolynomialFit(degree=4, boundary_weight=50.5, monotone_weight=3.25, resamples=7)
TRUST = Trust(*(np.full((3, 4), share, np.float32) for share in (1, 0.1, 0.7)))
OPTIONS = DeblurOptions(
    response=GivenResponse(Gamma(1.75)),
    edges=(Line((1.5, 2.0), (30.0, 4.25)), Edge((3.5, 4.25), (40.0, 9.0), 1, 11.5, 0.3)),
    blur_extent=9.5,
    psf=GivenPsf(KERNEL),
    method=Wiener(weight=0.01),
    regions=(2, 3),
)
OBJECTS = [
    Identity(),
    Gamma(1.8),
    SRGB(),
    Polynomial((0.3, 0.1, 0.6)),
    GeneralizedGamma((0.6, -0.3, 0.2)),
    Emor((1.5, -0.6, 0.1)),
    TABLE,
    Tuned(Tuned(TABLE, (0.01,)), (0.02, -0.01), 1.25),
    PRIOR,
    Line((1.5, 2.0), (30.0, 4.25)),
    Rectangle(((1.0, 2.0), (3.0, 9.5), (8.0, 7.0), (6.0, 0.0))),
    Edge((3.5, 4.25), (40.0, 9.0), -1, 11.5, 0.3, EdgeStatus.CLIPPED),
    ByOrientation(0.1),
    ByPolarity(0.2),
    ByEdge(0.3),
    EndPoints(0.1, 1.5),
    CommonShape((1.0, 2.5), (0.2, 0.5, 0.9)),
    ProfileSource(2, 5, 1),
    ProfileGroup(
        position=np.arange(4.0),
        intensity=RANDOM.random((2, 4)),
        variance=RANDOM.random((2, 4)),
        count=np.full((2, 4), 9.0),
        sides=np.array([[0.1, 0.9], [0.2, 0.7]]),
        sides_variance=np.full((2, 2), 1e-5),
        orientation=0.3,
        polarity=1,
        sources=(ProfileSource(0, 1, 0), ProfileSource(0, 2, 0)),
    ),
    GivenPsf(KERNEL),
    Variational(size=25, region=300),
    XuJia(size=25, region=300),
    L0Gradient(size=25, region=300),
    MinimalPixels(size=25, region=300),
    Portfolio(size=25, region=300),
    Fergus(size=25, region=300),
    Shan(size=25, region=300),
    Streaks(size=25),
    PsfAt(row=40.5, column=30.0, size=25),
    Beads(places=((40.5, 30.0), (20.0, 61.25)), size=25),
    MotionPath(points=((0.0, 3.5), (4.0, 7.0), (9.5, 7.25)), width=2.0),
    RadonFit(size=25, smoothness=1.0, sparsity=2.5),
    RadonMap(size=25, region=300, weight=0.5),
    PsfEstimate(GivenPsf(KERNEL).psf, PsfStatus.DOUBTFUL, {"halves": 0.25}),
    Poses(np.array([-0.1, 0.2]), RANDOM.random((2, 3, 3))),
    PsfField(
        RANDOM.random((1, 2, 3, 5)),
        ((PsfStatus.GOOD, PsfStatus.BORROWED),),
        (40, 60),
        Poses(np.zeros(1), RANDOM.random((1, 3, 3))),
        {"turn": 0.1},
    ),
    RankMinimization(Tail.ALL, RowScale.BY_RANGE, FIT),
    MeanProfile(FIT),
    KnownPsf(KERNEL, 1.5, FIT),
    MaximumLikelihood(Cameras.DORF, shift=0.2),
    MaximumLikelihood(PRIOR, KERNEL, NOISE, 0.4),
    NOISE,
    GivenResponse(Tuned(SRGB(), (0.1,), 0.9)),
    FIT,
    ResponseEstimate(
        Gamma(2.0),
        LEVELS,
        LEVELS**2 * 0.9,
        LEVELS**2,
        (0.1, 0.8),
        ResponseStatus.DOUBTFUL,
        {"objective": 1e-7},
        (Finding.NARROW, Finding.UNSURE),
        PRIOR,
    ),
    GivenResponse(Gamma(1.5)).estimate(),
    HyperLaplacian(weight=1e-3, model_error=0.02, exponent=0.5, stages=5, steps=2),
    SparseIrls(weight=2e-3, model_error=0.02, exponent=0.9, iterations=3, steps=5),
    LightNoise(1e-3, -2e-6, 1e-7, 3e-4),
    PlaneStatistics(0.02, 0.7),
    PlaneStatistics(0.02, 0.7, misfit=0.03, reckoned=0.5),
    Swing(0.01, 0.02, 0.3),
    Guarded(np.eye(3), np.eye(3, dtype=np.float32)),
    TRUST,
    Judged(np.eye(3), TRUST),
    Strengthened(Tiled(Wiener()), 1.5),
    PlaneStatistics(0.02, 0.7, LightNoise(0.0, 4e-4, 8e-6, 4e-4)),
    LocalShrinkage(weight=1e-5, model_error=0.02, stages=4),
    TotalVariation(weight=1e-3, model_error=0.02, iterations=9),
    RichardsonLucy(iterations=12, total_variation=0.01, damping=2.5),
    Tiled(RichardsonLucy(iterations=3), side=300, overlap=20),
    Wiener(weight=0.01, model_error=0.03),
    PerChannel((GivenResponse(Gamma(1.5)), MaximumLikelihood(), MeanProfile())),
    OPTIONS,
    Pixels("photo.png", "00ff", (40, 60, 3), "uint8"),
    Record(
        Pixels("a stack.tif", "00ff", (5, 40, 60), "uint16"),
        OPTIONS,
        until=Stage.RESTORE,
        plane=(3,),
        region=((0, 5), (2, 30), (4, 50)),
        white=4095.0,
        tiled=True,
        chosen={"blur_extent": 17.25, "psf": Variational(size=19)},
        versions={"numpy": "2.0"},
        result=Pixels("", "ff00", (5, 28, 46), "float32"),
    ),
]
CHOICES = [
    choice
    for kind in (
        *(Cameras, Channels, EdgeStatus, Finding, PsfStatus, ResponseStatus, RowScale, Stage, Tail),
        Verdict,
    )
    for choice in kind
]


def again(value):
    """The value after it was written as JSON and read."""
    return from_record(json.loads(json.dumps(to_record(value), allow_nan=False)))


def same(a, b):
    """Whether two values are equal to the last bit, arrays and fields too."""
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(map(same, a, b))
    if is_dataclass(a):
        names = [field.name for field in fields(a)]
        return type(a) is type(b) and all(same(getattr(a, n), getattr(b, n)) for n in names)
    return type(a) is type(b) and a == b


@pytest.mark.parametrize("value", OBJECTS, ids=lambda v: type(v).__name__)
def test_an_object_comes_back_as_it_was(value):
    assert same(again(value), value)


def test_the_default_estimator_comes_back_as_it_was():
    assert same(again(MaximumLikelihood()), MaximumLikelihood())


@pytest.mark.parametrize("choice", CHOICES, ids=str)
def test_a_choice_comes_back_as_it_was(choice):
    assert again(choice) is choice


def test_an_object_of_defaults_comes_back_as_it_was():
    for method in (HyperLaplacian(), XuJia(), RankMinimization(), CommonShape(), ByEdge()):
        assert again(method) == method


def test_every_class_with_a_record_is_tested():
    tested = {type(value) for value in (*OBJECTS, *CHOICES)}
    assert tested == set(MEMBERS.values())


def descendants(family):
    for child in family.__subclasses__():
        yield child
        yield from descendants(child)


@pytest.mark.parametrize(
    "family", [ResponseCurve, ResponseFit, PsfEstimator, Deconvolver, Grouping, Alignment]
)
def test_every_member_of_a_family_has_a_record(family):
    for stage in STAGES:
        for module in iter_modules(stage.__path__, f"{stage.__name__}."):
            import_module(module.name)
    # By name: dataclasses with slots are made twice, and the first lives on for a while.
    every = [c for c in descendants(family) if c.__module__.startswith(PACKAGE)]
    own = {c.__name__ for c in every if not isabstract(c)}
    assert own == {name for name, member in MEMBERS.items() if issubclass(member, family)}


@pytest.mark.parametrize(
    "array",
    [
        RANDOM.random((2, 3, 4)),
        RANDOM.random((3, 2)).astype(np.float32),
        np.array([[nan, -inf, 0.1], [inf, 1e-300, -0.0]]),
        np.array([nan, 0.1], dtype=np.float32),
        np.array([0.1, 65504], dtype=np.float16),
        np.array([[0, 2**64 - 1]], dtype=np.uint64),
        np.array([[-(2**63)], [5]]),
        np.array([True, False]),
        np.array(0.3),
        np.zeros((0, 3)),
        np.zeros((2, 0)),
        RANDOM.random((4, 6))[::-2, ::3],
        np.arange(3, dtype=">i2").astype(np.int16),
    ],
    ids=lambda a: f"{a.dtype}-{a.shape}",
)
def test_an_array_comes_back_as_it_was(array):
    assert same(again(array), array)
    assert again(array).shape == array.shape


@pytest.mark.parametrize(
    "value",
    [
        None,
        True,
        0,
        2**70,
        0.1,
        -0.0,
        "",
        "srgb",
        (),
        (1, (2.5, "a", None)),
        {},
        {"psf": None, "lines": (Line((0.0, 0.0), (1.0, 2.0)),)},
        {"type": "array", "items": (1,)},
        {"a": {"type": 3}},
        inf,
        -inf,
    ],
)
def test_a_plain_value_comes_back_as_it_was(value):
    assert same(again(value), value)


def test_not_a_number_comes_back():
    assert np.isnan(again({"residual": nan})["residual"])


def test_lists_become_tuples_and_paths_texts():
    assert again([1, [2, 3]]) == (1, (2, 3))
    assert again(Path("camera.json")) == "camera.json"


@pytest.mark.parametrize(
    ("value", "plain"),
    [
        (np.float64(0.1), 0.1),
        (np.float32(0.5), 0.5),
        (np.int64(7), 7),
        (np.uint8(7), 7),
        (np.bool_(True), True),
        (np.str_("a"), "a"),
        (np.longdouble(0.5), 0.5),
    ],
)
def test_numbers_of_numpy_become_plain(value, plain):
    assert to_record(value) == plain
    assert type(to_record(value)) is type(plain)


class Stranger(ResponseCurve):
    """A curve that no stage exports."""

    def _forward(self, irradiance):
        return irradiance

    _inverse = _slope = _forward


class Side(StrEnum):
    """A choice that no stage exports, and that is a text, too."""

    LEFT = "left"


@pytest.mark.parametrize(
    "value",
    [
        Stranger(),
        GivenResponse(Stranger()),
        Side.LEFT,
        Gamma,
        object(),
        {1: 2},
        {1, 2},
        b"bytes",
        1j,
        np.array([1j]),
        np.array(["a"]),
        np.array([None]),
        np.datetime64("2020-01-01"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_has_no_record_is_refused_with_advice(value):
    with pytest.raises(CrfDeblurError, match=r"cannot be recorded; keep to"):
        to_record(value)


@pytest.mark.parametrize(
    "record",
    [
        {"type": "Magic"},
        {"type": 3},
        {"type": None},
        {"type": ["Gamma"]},
        {"type": "ResponseCurve"},
        {"type": "os.system", "command": "true"},
        [{"a": {"type": "Magic"}}],
        {"type": "GivenResponse", "curve": {"type": "Magic"}},
        {1, 2},
    ],
    ids=repr,
)
def test_a_record_of_an_unknown_type_is_refused_with_advice(record):
    with pytest.raises(CrfDeblurError, match="not known; update"):
        from_record(record)


def changed(value, **entries):
    record = to_record(value) | entries
    return {key: each for key, each in record.items() if each != "gone"}


@pytest.mark.parametrize(
    "record",
    [
        changed(Gamma(2.0), exponent="gone"),
        changed(Gamma(2.0), extra=1),
        changed(Gamma(2.0), exponent=-1.0),
        changed(Gamma(2.0), exponent="2"),
        changed(Gamma(2.0), exponent=None),
        changed(Gamma(2.0), exponent=True),
        changed(XuJia(), size=5.5),
        changed(XuJia(), size=4),
        changed(Emor((0.1,)), coefficients=["a"]),
        changed(Emor((0.1,)), coefficients=0.1),
        changed(GivenResponse(SRGB()), curve="srgb"),
        changed(GivenResponse(SRGB()), curve=to_record(XuJia())),
        changed(GivenPsf(KERNEL), psf=[[0.0, 1.0]]),
        changed(Line((0.0, 1.0), (2.0, 3.0)), end=[0.0, 1.0]),
        changed(Line((0.0, 1.0), (2.0, 3.0)), end=[0.0]),
        changed(NOISE, floor=0.0),
        changed(NOISE, freedom="1"),
        changed(PRIOR, mean="gone"),
        changed(PRIOR, mean=None),
        changed(PRIOR, mean=to_record(LEVELS)),
        changed(PRIOR, mean=to_record(PRIOR.mean[::-1])),
        changed(PRIOR, mean=to_record(PRIOR.mean * nan)),
        changed(PRIOR, directions=to_record(PRIOR.mean)),
        changed(PRIOR, directions=to_record(PRIOR.directions[:, :9])),
        changed(PRIOR, directions=to_record(PRIOR.directions + 1)),
        changed(MaximumLikelihood(), prior=None),
        changed(MaximumLikelihood(), prior="digital"),
        changed(MaximumLikelihood(), prior=to_record(Tail.ALL)),
        changed(MaximumLikelihood(), prior=to_record(Gamma(2.0))),
        changed(MaximumLikelihood(), prior=[to_record(PRIOR)]),
        changed(MaximumLikelihood(), psf=0.5),
        changed(MaximumLikelihood(), noise=None),
        changed(MaximumLikelihood(), shift=-1.0),
        changed(GivenResponse(SRGB()).estimate(), findings=to_record(Finding.NARROW)),
        changed(GivenResponse(SRGB()).estimate(), findings=[to_record(Tail.ALL)]),
        changed(GivenResponse(SRGB()).estimate(), findings=["NARROW"]),
        changed(GivenResponse(SRGB()).estimate(), findings=None),
        changed(GivenResponse(SRGB()).estimate(), posterior=to_record(Cameras.SRGB)),
        changed(GivenResponse(SRGB()).estimate(), posterior="gone"),
        changed(Finding.NARROW, name="WIDE"),
        changed(Cameras.DORF, name="FILM"),
        changed(PsfEstimate(KERNEL, PsfStatus.GOOD), diagnostics={"halves": "many"}),
        changed(Tail.ALL, name="MOST"),
        changed(Tail.ALL, name="gone"),
        changed(Tail.ALL, name=["ALL"]),
        changed(KERNEL, data="gone"),
        changed(KERNEL, shape=[5, 3]),
        changed(KERNEL, shape=15),
        changed(KERNEL, shape=[-1, 5]),
        changed(KERNEL, data=[[1, 2], [3]]),
        changed(KERNEL, data=["a"], shape=[1]),
        changed(KERNEL, dtype="object"),
        changed(KERNEL, dtype="nonsense"),
        changed(KERNEL, data=[300], shape=[1], dtype="uint8"),
        {"type": "float"},
        {"type": "float", "value": "much"},
        {"type": "dict", "items": [1]},
        {"type": "dict"},
    ],
    ids=lambda record: f"{record!r:.60}",
)
def test_a_damaged_record_is_refused_with_advice(record):
    with pytest.raises(CrfDeblurError, match=r"damaged \(.*mend the file"):
        from_record(record)


def test_a_psf_that_is_none_is_refused():
    record = changed(GivenPsf(KERNEL), psf=to_record(np.full((3, 3), -1.0)))
    with pytest.raises(CrfDeblurError, match="negative values"):
        from_record(record)

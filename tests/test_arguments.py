"""Every public call checks what it is given: a finite result, or a sentence that says why not."""

import inspect
import warnings
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import fields, is_dataclass
from enum import Enum
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import napari_crfdeblur as package
from napari_crfdeblur import (
    deconvolution,
    edges,
    estimate,
    photo,
    profiles,
    psf,
    quality,
    response,
    simulate,
)
from napari_crfdeblur.deconvolution import (
    Deconvolver,
    LightNoise,
    PlaneStatistics,
    RichardsonLucy,
    Wiener,
    deconvolve,
)
from napari_crfdeblur.edges import Edge, Line, Rectangle
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import (
    GivenResponse,
    MeanProfile,
    PolynomialFit,
    ResponseEstimate,
    ResponseFit,
    ResponseStatus,
    estimate_response,
)
from napari_crfdeblur.large import measure_large, restore_large
from napari_crfdeblur.profiles import (
    Alignment,
    ByOrientation,
    EndPoints,
    Grouping,
    ProfileGroup,
    ProfileSource,
    sample_profiles,
)
from napari_crfdeblur.psf import (
    GivenPsf,
    Poses,
    PsfEstimate,
    PsfEstimator,
    PsfField,
    PsfStatus,
    RadonFit,
)
from napari_crfdeblur.response import Gamma, Identity, ResponseCurve, ResponsePrior, linearize
from napari_crfdeblur.simulate import (
    Camera,
    CameraMotion,
    ProfileCase,
    Scene,
    TrueEdge,
    random_profiles,
    slanted_edges,
)

SHAPE = (24, 33)
RNG = np.random.default_rng(20)
ROWS, COLUMNS = np.mgrid[:24, :33]
STEP = np.clip((COLUMNS - 15.3 - 0.1 * ROWS) / 4 + 0.5, 0, 1)
PLANE = (0.15 + 0.6 * STEP + 0.01 * RNG.standard_normal(SHAPE)).astype(np.float32)
COLOR = np.stack([PLANE, 0.9 * PLANE + 0.02, 1 - PLANE], axis=-1)
PHOTO = np.rint(255 * PLANE).astype(np.uint8)
KERNEL = np.array([[0.0, 1, 2, 4, 0], [1, 3, 0, 1, 0], [0, 2, 1, 0, 0]])
SHAKEN = np.pad(KERNEL, [(1, 1), (0, 0)]) / KERNEL.sum()
CAMERA = Camera(Gamma(1.8), noise=0.002)
CASE = ProfileCase(groups=2, profiles=4, samples=15)
GROUPS = tuple(random_profiles(CAMERA, CASE, seed=3))
EDGE = Edge((2.0, 15.5), (21.0, 17.4), polarity=1, width=5.0, contrast=0.6)
NODES = 513
PRIOR = response.around(Gamma(2.0))
FIELD = PsfField(np.stack([[SHAKEN, SHAKEN]]), ((PsfStatus.GOOD,) * 2,), SHAPE)
BAND = np.linspace(0, 1, 9)
ESTIMATE = {
    "curve": Gamma(2.0),
    "intensity": BAND,
    "lower": BAND**2,
    "upper": BAND**1.8,
    "covered": (0.1, 0.9),
    "status": ResponseStatus.GOOD,
    "diagnostics": {"profiles": 3.0},
    "findings": (),
    "posterior": PRIOR,
}
ROW = GROUPS[0]
GROUP = {field.name: getattr(ROW, field.name) for field in fields(ROW)}

# A call of every public function and constructor that is right.
CALLS: dict[Any, dict[str, Any]] = {
    edges.find_edges: {"image": PHOTO, "blur_extent": 5.0},
    edges.refine_edges: {"image": PHOTO, "lines": [Line((2, 15), (21, 17))], "blur_extent": 5.0},
    edges.estimate_blur_extent: {"image": PHOTO},
    edges.Line: {"start": (2.0, 15.0), "end": (21.0, 17.0)},
    edges.Rectangle: {"corners": ((2, 12), (2, 19), (21, 20), (21, 13))},
    edges.Edge: {
        "start": (2.0, 15.5),
        "end": (21.0, 17.4),
        "polarity": 1,
        "width": 5.0,
        "contrast": 0.6,
        "status": edges.EdgeStatus.GOOD,
    },
    profiles.sample_profiles: {
        "image": PHOTO,
        "edges": [EDGE],
        "grouping": ByOrientation(),
        "alignment": EndPoints(),
        "channels": profiles.Channels.SEPARATE,
        "index": 2,
    },
    profiles.ByEdge: {"tolerance": 0.05},
    profiles.ByOrientation: {"tolerance": 0.05},
    profiles.ByPolarity: {"tolerance": 0.05},
    profiles.CommonShape: {"exponents": (1.0, 2.0), "levels": (0.1, 0.5, 0.9)},
    profiles.EndPoints: {"level": 0.05, "exponent": 1.4},
    profiles.ProfileGroup: GROUP,
    profiles.ProfileSource: {"image": 0, "edge": 1, "channel": 2},
    profiles.of_channel: {"groups": GROUPS, "channel": 0},
    response.linearize: {"photo": PLANE, "curve": Gamma(2.2)},
    response.reapply: {"linear": PLANE, "curve": Gamma(2.2), "dtype": np.uint8},
    response.clipped_pixels: {"photo": PHOTO, "level": 0.9, "scatter": 0.01},
    response.clipped_share: {"linear": PLANE},
    response.around: {"curve": Gamma(2.2), "share": 0.3},
    response.tuned: {"base": Gamma(2.2), "offsets": (0.1, -0.2), "gamma": 1.1},
    response.monotone: {"intensity": BAND, "irradiance": BAND**2},
    response.dorf_mean: {},
    response.emor_table: {},
    response.SRGB: {},
    response.Identity: {},
    response.Emor: {"coefficients": (0.2, -0.1)},
    response.Gamma: {"exponent": 2.2},
    response.GeneralizedGamma: {"coefficients": (0.5, 0.1)},
    response.Polynomial: {"coefficients": (0.3, 0.7)},
    response.Tabulated: {"irradiance": BAND, "intensity": BAND**0.5},
    response.Tuned: {"base": Gamma(2.2), "offsets": (0.01,), "gamma": 1.1},
    response.ResponsePrior: {"mean": PRIOR.mean, "directions": PRIOR.directions},
    psf.as_psf: {"values": KERNEL},
    psf.centered: {"psf": SHAKEN},
    psf.cleared: {"psf": SHAKEN, "share": 0.1},
    psf.project: {"psf": SHAKEN, "angle": 0.3, "positions": np.arange(-4.0, 5.0)},
    psf.delta: {},
    psf.kernel_a: {},
    psf.kernel_b: {},
    psf.line: {"length": 4.5, "angle": 0.4},
    psf.disk: {"radius": 2.2},
    psf.gaussian: {"sigma": 1.1},
    psf.camera_shake: {"size": 7, "seed": 5},
    psf.GivenPsf: {"psf": KERNEL},
    psf.Poses: {"turns": np.array([-0.01, 0.01]), "times": np.full((2, 3, 3), 1 / 18)},
    psf.PsfEstimate: {"psf": SHAKEN, "status": PsfStatus.GOOD, "diagnostics": {"peak": 0.2}},
    psf.PsfField: {
        "psfs": FIELD.psfs,
        "statuses": FIELD.statuses,
        "shape": SHAPE,
        "poses": None,
        "diagnostics": {},
    },
    psf.RadonFit: {"size": 5, "smoothness": 2.0, "sparsity": 3.0},
    psf.Fergus: {"size": 3, "region": 20},
    psf.Shan: {"size": 3, "region": 20},
    psf.Variational: {"size": 3, "region": 20},
    psf.XuJia: {"size": 3, "region": 20},
    estimate.estimate_response: {"groups": GROUPS, "method": GivenResponse(Gamma(2.0))},
    estimate.GivenResponse: {"curve": Gamma(2.0)},
    estimate.MaximumLikelihood: {
        "prior": PRIOR,
        "psf": KERNEL,
        "noise": estimate.NoiseModel(),
        "shift": 0.3,
        "channel_shift": 0.1,
    },
    estimate.NoiseModel: {"floor": 0.001, "mismatch": 0.01, "freedom": 2.0},
    estimate.KnownPsf: {
        "psf": KERNEL,
        "largest_shift": 1.0,
        "polynomial": PolynomialFit(resamples=0),
    },
    estimate.MeanProfile: {"polynomial": PolynomialFit(resamples=0)},
    estimate.RankMinimization: {
        "tail": estimate.Tail.SECOND,
        "scale": estimate.RowScale.RAW,
        "polynomial": PolynomialFit(resamples=0),
    },
    estimate.PolynomialFit: {
        "degree": 4,
        "boundary_weight": 100.0,
        "monotone_weight": 10.0,
        "resamples": 1,
    },
    estimate.ResponseEstimate: ESTIMATE,
    deconvolution.deconvolve: {
        "linear": PLANE,
        "psf": KERNEL,
        "method": Wiener(),
        "clipped": PLANE > 0.8,
    },
    deconvolution.deconvolve_slices: {
        "stack": np.stack([PLANE, 1 - PLANE]),
        "psf": KERNEL,
        "method": Wiener(),
        "clipped": np.stack([PLANE, 1 - PLANE]) > 0.8,
    },
    deconvolution.deconvolve_varying: {
        "linear": PLANE,
        "psfs": FIELD,
        "method": RichardsonLucy(iterations=2),
        "clipped": PLANE > 0.8,
    },
    deconvolution.fit_noise: {"plane": PLANE},
    deconvolution.noise_level: {"plane": PLANE},
    deconvolution.measure: {"plane": PLANE, "psf": SHAKEN, "clipped": PLANE > 0.8},
    deconvolution.LightNoise: {"gain": 0.01, "offset": 1e-4, "least": 1e-5, "mean": 1e-3},
    deconvolution.PlaneStatistics: {
        "noise": 0.01,
        "contrast": 0.8,
        "model": LightNoise(0.01, 1e-4, 1e-5, 1e-3),
        "misfit": 0.02,
    },
    deconvolution.Wiener: {"weight": 0.01, "model_error": 0.01},
    deconvolution.HyperLaplacian: {
        "weight": 0.01,
        "model_error": 0.01,
        "exponent": 0.7,
        "stages": 2,
        "steps": 1,
    },
    deconvolution.LocalShrinkage: {"weight": 0.01, "model_error": 0.01, "stages": 2},
    deconvolution.RichardsonLucy: {"iterations": 3, "total_variation": 0.002, "damping": 1.0},
    deconvolution.SparseIrls: {
        "weight": 0.01,
        "model_error": 0.01,
        "exponent": 0.8,
        "iterations": 1,
        "steps": 2,
    },
    deconvolution.TotalVariation: {"weight": 0.01, "model_error": 0.01, "iterations": 2},
    deconvolution.Tiled: {"method": Wiener(), "side": 30, "overlap": 3},
    simulate.simulate: {
        "scene": Scene(PLANE),
        "psf": KERNEL,
        "camera": CAMERA,
        "seed": 4,
    },
    simulate.slanted_edges: {"shape": SHAPE, "seed": 1, "pitch": 12.0, "channels": 3},
    simulate.step_image: {"shape": SHAPE, "levels": (0.1, 0.5, 0.9)},
    simulate.street: {"shape": SHAPE, "seed": 2},
    simulate.camera_turn: {"size": 5, "turn": 0.02, "seed": 3, "shape": SHAPE},
    simulate.random_profiles: {"camera": CAMERA, "case": CASE, "seed": 5},
    simulate.Camera: {
        "response": Gamma(2.2),
        "noise": 0.01,
        "photons": 1e4,
        "bits": 8,
        "jpeg": 90,
    },
    simulate.CameraMotion: {"shifts": np.array([[0.0, 1], [1, 0]]), "turns": np.array([0, 0.01])},
    simulate.ProfileCase: {
        "groups": 1,
        "profiles": 3,
        "samples": 9,
        "averaged": 2,
        "levels": CASE.levels,
        "falling": 0.5,
        "bad": 0.2,
    },
    simulate.Scene: {"linear": PLANE, "edges": (TrueEdge(Line((0, 1), (9, 2)), (0.1,), (0.9,)),)},
    simulate.TrueEdge: {"line": Line((0, 1), (9, 2)), "before": (0.1,), "after": (0.9,)},
    quality.psnr: {"image": PHOTO, "truth": PLANE, "border": 4},
    quality.ssim: {"image": PHOTO, "truth": PLANE, "border": 4},
    quality.aligned: {"image": PHOTO, "truth": PLANE, "border": 4},
    quality.ringing: {"restored": PLANE, "blurred": PLANE, "extent": 3},
    quality.kernel_similarity: {"a": KERNEL, "b": SHAKEN},
    quality.response_error: {"curve": Gamma(2.0), "truth": Gamma(2.2), "covered": (0.1, 0.9)},
    quality.response_error_full: {"curve": Gamma(2.0), "truth": Gamma(2.2)},
    photo.to_unit: {"photo": PHOTO},
    photo.from_unit: {"intensity": PLANE, "dtype": np.uint8},
    photo.check_photo: {"photo": PHOTO},
    restore_large: {
        "photo": PHOTO,
        "curve": Gamma(2.2),
        "psf": KERNEL,
        "method": Wiener(),
        "channels": False,
        "statistics": (PlaneStatistics(0.01, 0.8),),
    },
    measure_large: {"photo": PHOTO, "curve": Gamma(2.2), "channels": False, "psf": SHAKEN},
}

WRONG: list[Any] = [
    None,
    True,
    "x",
    "",
    b"x",
    -1,
    0,
    1,
    4,
    2.5,
    1e9,
    1e308,
    -1e308,
    5e-324,
    float("nan"),
    float("inf"),
    -float("inf"),
    10**9,
    10**30,
    -(10**400),
    1j,
    [],
    (),
    {},
    set(),
    object(),
    int,
    Gamma,
    Gamma(2.0),
    Wiener,
    np.sin,
    Path("x"),
    [1, "a"],
    [[1], [2, 3]],
    [None],
    (1.0, 2.0),
    (10**9, 10**9),
    (float("nan"), 1.0),
    ((0.0, 0.0), (1e9, 1e9)),
    [Edge((0.0, 1e9), (20.0, 1e9))],
    [Edge((2.0, 3.0), (9.0, 20.0))],
    [Line((2.0, 3.0), (9.0, 1e9))],
    [Rectangle(((0, 0), (0, 1e9), (1e9, 1e9), (1e9, 0)))],
    np.float32(0.5),
    np.int64(3),
    np.array([]),
    np.array(1.0),
    np.zeros((0, 33)),
    np.zeros(SHAPE),
    np.zeros(3),
    np.ones((2, 2, 2, 2)),
    np.full(SHAPE, np.nan, dtype=np.float32),
    np.where(np.eye(24, 33), np.inf, 0.5),
    -PLANE,
    (PLANE - 0.4).astype(np.float64),
    np.full((3, 3), 1.7e308),
    np.full(SHAPE, 1e308),
    np.full(SHAPE, 1e38, dtype=np.float32),
    np.full(SHAPE, 5e-324),
    PLANE.astype(np.float16),
    PLANE.astype(">f8"),
    PLANE + 1j,
    PLANE.astype(object),
    PLANE.astype(str),
    PLANE > 0.5,
    PHOTO.astype("datetime64[s]"),
    PHOTO.astype(np.int64),
    PHOTO.astype([("a", "u1")]),
    np.ones((5, 5, 3)),
    np.asfortranarray(PLANE),
    np.ma.masked_less(PLANE, 0.3),
    (number for number in ()),
]

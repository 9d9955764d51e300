"""The sample photos are what their metadata say."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from napari.layers import Image

from napari_crfdeblur import linearize, response
from napari_crfdeblur._napari import samples
from napari_crfdeblur.edges import find_edges
from napari_crfdeblur.psf import as_psf
from napari_crfdeblur.response import ResponseCurve
from napari_crfdeblur.simulate import (
    Camera,
    Scene,
    Simulated,
    simulate,
    slanted_edges,
    step_image,
    street,
)


@dataclass(frozen=True)
class Sample:
    key: str
    make: Callable[[], Any]
    scene: Callable[[int], Scene]
    shape: tuple[int, ...]
    dtype: type[np.generic]


SAMPLES = [
    Sample("step_image", samples.steps, lambda _: step_image((300, 480)), (294, 460), np.uint8),
    Sample(
        "slanted_edges",
        samples.slanted,
        lambda seed: slanted_edges((600, 800), seed=seed, channels=3),
        (590, 790, 3),
        np.uint16,
    ),
    Sample(
        "blurred_photo",
        samples.photo,
        lambda seed: street((614, 914), seed=seed),
        (600, 900, 3),
        np.uint8,
    ),
    Sample("microscope_slide", samples.slide, samples.section, (4, 450, 600), np.uint16),
]
every_sample = pytest.mark.parametrize("sample", SAMPLES, ids=lambda sample: sample.key)


@cache
def layer_of(sample: Sample) -> Image:
    ((pixels, options, kind),) = sample.make()
    assert kind == "image"
    return Image(pixels, **options)


@cache
def made_again(sample: Sample) -> tuple[Simulated, ...]:
    """The photos of the layer, simulated from nothing but the truth that it tells."""
    truth = layer_of(sample).metadata["truth"]
    noise, photons = truth["noise"], truth["photons"] or np.inf
    camera = Camera(true_response(sample), noise=noise, photons=photons, bits=None)
    seeds = [truth["seed"]] if isinstance(truth["seed"], int) else truth["seed"]
    psf = np.array(truth["psf"])
    return tuple(simulate(sample.scene(seed), psf, camera, seed=seed) for seed in seeds)


def true_response(sample: Sample) -> ResponseCurve:
    parameters = dict(layer_of(sample).metadata["truth"]["response"])
    return getattr(response, parameters.pop("curve"))(**parameters)


def photos(sample: Sample) -> list[Any]:
    layer = layer_of(sample)
    return [layer.data] if layer.rgb or layer.ndim == 2 else list(layer.data)


@every_sample
@pytest.mark.usefixtures("plugin")
def test_a_sample_opens_as_one_image_over_its_full_scale(
    sample: Sample, viewer: ViewerModel
) -> None:
    (layer,) = viewer.open_sample("napari-crfdeblur", sample.key)
    assert layer.data.shape == sample.shape
    assert layer.data.dtype == sample.dtype
    assert layer.rgb == (sample.shape[-1] == 3)
    assert tuple(layer.contrast_limits) == (0, np.iinfo(sample.dtype).max)
    assert np.iinfo(sample.dtype).bits == layer.metadata["truth"]["bits"]
    assert np.array_equal(layer.data, layer_of(sample).data), "another one each time"


@every_sample
def test_the_truth_can_be_written_as_json(sample: Sample) -> None:
    truth = layer_of(sample).metadata["truth"]
    assert json.loads(json.dumps(truth, allow_nan=False)) == truth


@every_sample
def test_the_truth_makes_the_photo(sample: Sample) -> None:
    for photo, made in zip(photos(sample), made_again(sample), strict=True):
        levels = made.photo * np.iinfo(sample.dtype).max
        assert np.abs(photo - levels).max() <= 0.51  # rounding


@every_sample
def test_undoing_the_true_response_leaves_blurred_light(sample: Sample) -> None:
    for photo, made in zip(photos(sample), made_again(sample), strict=True):
        error = linearize(photo, true_response(sample)) - made.blurred_linear
        assert np.sqrt(np.mean(error**2)) < 0.006


@every_sample
def test_the_true_psf_blurs(sample: Sample) -> None:
    psf = np.array(layer_of(sample).metadata["truth"]["psf"])
    assert np.allclose(as_psf(psf), psf, rtol=0, atol=1e-12)
    assert psf.max() < 0.3


@every_sample
def test_a_sample_has_edges_to_be_found(sample: Sample) -> None:
    good = [edge for edge in find_edges(photos(sample)[0], blur_extent=20) if edge.good]
    assert len(good) >= (3 if sample.key == "step_image" else 12)


def test_the_slide_has_a_place_in_space() -> None:
    slide = layer_of(SAMPLES[-1])
    assert tuple(slide.scale) == (1.0, 0.2, 0.2)
    assert [str(unit) for unit in slide.units] == ["micrometer"] * 3
    assert slide.axis_labels == ("z", "y", "x")

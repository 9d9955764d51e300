"""The place of the color channels, measured on edges of known displacement."""

from dataclasses import replace

import numpy as np
import pytest

from napari_crfdeblur.estimate import MaximumLikelihood, estimate_response
from napari_crfdeblur.estimate.base import Finding
from napari_crfdeblur.estimate.likelihood.registration import misregistration
from napari_crfdeblur.profiles import ProfileSource
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import camera_shake, project
from napari_crfdeblur.response import SRGB
from napari_crfdeblur.simulate import Camera
from napari_crfdeblur.simulate.profiles import recorded

POSITION = np.arange(-14.0, 15.0)
DISPLACED = np.array([[0.31, -0.12], [0.05, 0.02], [-0.36, 0.10]])  # sum 0, (row, column)


def colored(angles, displaced, seed=0, edges=6):
    """Groups of edges between random colors, with displaced channels, one angle each."""
    rng = np.random.default_rng(seed)
    psf = camera_shake(11, 3)
    groups = []
    for angle in angles:
        normal = np.array([np.sin(angle), np.cos(angle)])
        sides = rng.uniform(0.02, 0.95, (edges, len(displaced), 2))
        light = np.stack(
            [
                sides[:, c, :1]
                + np.diff(sides[:, c]) * project(psf, angle, POSITION - normal @ displaced[c])
                for c in range(len(displaced))
            ],
            axis=1,
        )
        group = recorded(
            light.reshape(-1, POSITION.size),
            sides.reshape(-1, 2),
            Camera(SRGB(), noise=0.002),
            rng,
            averaged=20,
            orientation=angle,
        )
        sources = [ProfileSource(0, e, c) for e in range(edges) for c in range(len(displaced))]
        groups.append(replace(group, sources=tuple(sources)))
    return groups


def found(groups):
    return drain(MaximumLikelihood().fitting(groups)).fits[0].found


@pytest.mark.parametrize("angles", [(0.2, 0.9, 1.9, 2.6), (0.4, 1.7)])
def test_the_place_of_each_channel_is_measured(angles):
    measured = misregistration(found(colored(angles, DISPLACED)))
    # One step about a solution whose channels were bound to within a tenth of a pixel.
    np.testing.assert_allclose(measured, DISPLACED, atol=0.05)


def test_channels_in_place_are_not_moved():
    measured = misregistration(found(colored((0.2, 1.3, 2.2), np.zeros((3, 2)))))
    np.testing.assert_allclose(measured, 0, atol=0.02)


def test_along_edges_of_one_orientation_nothing_is_seen():
    angle = 0.7
    measured = misregistration(found(colored((angle,), DISPLACED)))
    along = np.array([np.cos(angle), -np.sin(angle)])
    across = np.array([np.sin(angle), np.cos(angle)])
    np.testing.assert_allclose(measured @ along, 0, atol=1e-9)
    np.testing.assert_allclose(measured @ across, DISPLACED @ across, atol=0.05)


def test_gray_edges_have_no_misregistration():
    assert misregistration(found(colored((0.2, 1.3), np.zeros((1, 2))))).tolist() == [[0, 0]]


def test_the_estimate_tells_of_channels_that_lie_far_apart():
    angles = (0.2, 0.9, 1.9, 2.6)
    near = estimate_response(colored(angles, DISPLACED), MaximumLikelihood())
    far = estimate_response(colored(angles, 4 * DISPLACED), MaximumLikelihood())
    assert Finding.MISREGISTERED not in near.findings
    assert Finding.MISREGISTERED in far.findings
    # Half of the largest distance between two channels of each.
    assert near.diagnostics["channel shift"] == pytest.approx(0.35, abs=0.05)
    assert far.diagnostics["channel shift"] > 0.7

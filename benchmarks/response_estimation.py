"""Error and speed of the response estimators on ideal profiles, as tables in Markdown.

Run it with one thread, so that CPU times compare::

    OMP_NUM_THREADS=1 python benchmarks/response_estimation.py            # all 201 curves
    OMP_NUM_THREADS=1 python benchmarks/response_estimation.py --every 10

The profiles come straight from the model, without a picture: this measures the estimators, not
the edges that they live on. The true responses are the 201 curves of DoRF in
``../shared/data`` beside the repository if they are there, else EMoR curves with random
coefficients. The error is that of the inverse response after the best affine alignment, over
the range of intensity that the profiles cover. The searches start from the mean of DoRF, to
which each true curve has contributed a 201st.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from suites import DATA, dorf_curves

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import (
    KnownPsf,
    MeanProfile,
    PolynomialFit,
    RankMinimization,
    ResponseFit,
    RowScale,
    Tail,
    estimate_response,
)
from napari_crfdeblur.estimate.band import covered_range
from napari_crfdeblur.estimate.paper import polynomial as poly
from napari_crfdeblur.estimate.paper.search import search
from napari_crfdeblur.profiles.base import ProfileGroup
from napari_crfdeblur.psf.projection import project
from napari_crfdeblur.psf.shapes import camera_shake
from napari_crfdeblur.quality import response_error
from napari_crfdeblur.response import (
    SRGB,
    Gamma,
    Identity,
    ResponseCurve,
    dorf_mean,
    linearize,
    reapply,
)
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles
from napari_crfdeblur.simulate.profiles import from_black, recorded

Floats = NDArray[np.floating]
Errors = dict[str, Floats]
ALONE = PolynomialFit(resamples=0)  # without the band
FOLLOWED = 0.01  # error up to which a polynomial is said to follow a curve


@dataclass(frozen=True)
class Case:
    noise: float
    profiles: ProfileCase


CASES = {
    "8 profiles, 8 bit": Case(0, ProfileCase()),
    "8 profiles, noise .005": Case(0.005, ProfileCase()),
    "8 profiles, noise .01": Case(0.01, ProfileCase()),
    "4 groups x 8, noise .005": Case(0.005, ProfileCase(groups=4)),
    "3 profiles, noise .005": Case(0.005, ProfileCase(profiles=3)),
    "8 from black, noise .005": Case(0.005, ProfileCase(levels=from_black)),
    "4 x 8, noise .005, 25 % bad": Case(0.005, ProfileCase(groups=4, bad=0.25)),
}
SPLIT = ("8 profiles, 8 bit", "8 profiles, noise .005", "4 groups x 8, noise .005")
FIXED: dict[str, ResponseCurve] = {
    "identity": Identity(),
    "gamma 2.2": Gamma(2.2),
    "sRGB": SRGB(),
    "DoRF mean": dorf_mean(),
}
METHODS: dict[str, ResponseFit] = {
    "Eq. 5": MeanProfile(ALONE),
    "Eq. 8": RankMinimization(Tail.ALL, RowScale.RAW, ALONE),
    "Eq. 10": RankMinimization(Tail.SECOND, RowScale.RAW, ALONE),
    "Eq. 10, rows / range": RankMinimization(Tail.SECOND, RowScale.BY_RANGE, ALONE),
}
KNOWN = "Eq. 4, known PSF"
NEAREST = "nearest polynomial"  # not an estimate: fitted to the truth


def shaken_profiles(camera: Camera, case: ProfileCase, seed: int) -> tuple[Floats, list]:
    """One 2-D camera shake, and groups of edges at several angles that it has blurred."""
    rng = np.random.default_rng(seed)
    psf = camera_shake(2 * int(rng.integers(9, 16)) + 1, seed)
    position = np.arange(case.samples) - (case.samples - 1) / 2
    fine = np.linspace(-case.samples, case.samples, 100 * case.samples)
    groups = []
    for angle in np.pi * (np.arange(case.groups) + rng.uniform()) / case.groups:
        # Aligned by the two end points, as profiles are.
        middle = np.interp([0.01, 0.99], project(psf, angle, fine), fine).mean()
        sides = case.levels(rng, case.profiles)
        shapes = np.tile(project(psf, angle, position + middle), (case.profiles, 1))
        for row in range(round(case.bad * case.profiles)):
            shapes[row] = flawed(rng, psf, angle, position + middle)
        light = np.clip(sides[:, :1] + np.diff(sides) * shapes, 0, 1)
        groups.append(recorded(light, sides, camera, rng, orientation=angle))
    return psf, groups


def flawed(rng: np.random.Generator, psf: Floats, angle: float, position: Floats) -> Floats:
    """Edge spread of an edge that runs elsewhere, has a neighbor, or lies in a shadow."""
    flaw, spread = rng.integers(3), project(psf, angle, position)
    if flaw == 0:
        return project(psf, angle + rng.uniform(0.5, 1.5), position)
    if flaw == 1:
        beside = rng.choice([-1, 1]) * rng.uniform(0.2, 0.4) * position.size
        return spread + rng.uniform(-0.3, 0.3) * (project(psf, angle, position - beside) - 0.5)
    return spread + rng.uniform(-0.3, 0.3) * np.maximum(position, 0) / position[-1]


def error(groups: list[ProfileGroup], method: ResponseFit, truth: ResponseCurve) -> float:
    """Error of an estimate; of the DoRF mean where there is none."""
    try:
        curve = estimate_response(groups, method).curve
    except CrfDeblurError:
        curve = dorf_mean()
    return response_error(curve, truth, covered_range(groups))


def errors(truths: list[tuple[int, ResponseCurve]], case: Case) -> Errors:
    """Error of every method for every true curve, by the name of the method."""
    found: dict[str, list[float]] = {name: [] for name in [*FIXED, NEAREST, *METHODS, KNOWN]}
    for seed, truth in truths:
        camera = Camera(truth, noise=case.noise)
        groups = random_profiles(camera, case.profiles, seed=seed)
        for name, curve in FIXED.items():
            found[name].append(response_error(curve, truth, covered_range(groups)))
        found[NEAREST].append(
            response_error(nearest_polynomial(truth), truth, covered_range(groups))
        )
        for name, method in METHODS.items():
            found[name].append(error(groups, method, truth))
        psf, shaken = shaken_profiles(camera, case.profiles, seed)
        method = KnownPsf(psf, largest_shift=0, polynomial=ALONE)
        found[KNOWN].append(error(shaken, method, truth))
    return {name: np.array(values) for name, values in found.items()}


def nearest_polynomial(truth: ResponseCurve) -> ResponseCurve:
    """The best that a rising polynomial of degree 5 can do on [0, 1]."""
    levels = np.linspace(0, 1, poly.LEVELS)
    samples, target = poly.powers(levels, 5), truth.to_irradiance(levels)

    def objective(a: Floats) -> tuple[float, Floats]:
        miss = samples @ a - target
        ends, ends_slope = poly.boundary(a)
        falls, falls_slope = poly.falling_steps(a)
        value = miss @ miss / miss.size + ends + falls
        return value, 2 * miss @ samples / miss.size + ends_slope + falls_slope

    return poly.as_curve(search(objective, poly.dorf_mean_coefficients(5)).coefficients)


def table(head: list[str], rows: list[list[str]]) -> None:
    for row in [head, ["---"] * len(head), *rows]:
        print("| " + " | ".join(row) + " |")
    print()


def short(value: float) -> str:
    return f"{value:.4f}".removeprefix("0")


def cell(values: Floats) -> str:
    """Mean, with its standard error, and median."""
    if not values.size:
        return "-"
    spread = values.std() / np.sqrt(values.size)
    return f"{short(values.mean())} ± {short(spread)} / {short(np.median(values))}"


def accuracy(truths: list[tuple[int, ResponseCurve]]) -> None:
    measured = {name: errors(truths, case) for name, case in CASES.items()}
    shown = [*METHODS, KNOWN]
    for title, columns in (
        (
            "Error of fixed curves and of the rising polynomial of degree 5 nearest to the truth: "
            "mean ± its standard error / median",
            [*FIXED, NEAREST],
        ),
        ("Error of estimates, likewise", shown),
    ):
        print(f"{title}\n")
        table(
            ["profiles", *columns],
            [[name, *(cell(found[c]) for c in columns)] for name, found in measured.items()],
        )
    nearest = np.array([response_error(nearest_polynomial(t), t) for _, t in truths])
    followed = nearest <= FOLLOWED
    print(
        f"The same for the {followed.sum()} curves that a rising polynomial of degree 5 follows "
        f"to {short(FOLLOWED)} and for the {(~followed).sum()} others\n"
    )
    splits = [
        (f"{case}, {kind}", measured[case], mask)
        for case in SPLIT
        for kind, mask in (("followed", followed), ("others", ~followed))
    ]
    table(
        ["profiles, curves", *shown],
        [[name, *(cell(found[m][mask]) for m in shown)] for name, found, mask in splits],
    )


def cpu(work: Callable[[], object], runs: int = 5) -> float:
    """Least CPU time of several runs, in milliseconds."""
    times = []
    for _ in range(runs):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return 1e3 * min(times)


def speed() -> None:
    plane = np.random.default_rng(0).random((3072, 4096), dtype=np.float32)
    pair = cpu(lambda: fft.irfft2(fft.rfft2(plane), plane.shape))
    camera = Camera(dorf_mean(), noise=0.005)
    groups = random_profiles(camera, ProfileCase(groups=8, profiles=50), seed=0)
    print(
        "One estimate from 8 groups of 50 profiles of 41 samples, without the band; a pair is "
        f"rfft2 + irfft2 of 3072 x 4096 float32, {pair:.0f} ms\n"
    )
    table(
        ["method", "CPU ms", "pairs"],
        [
            [name, f"{ms:.0f}", f"{ms / pair:.2f}"]
            for name, method in METHODS.items()
            if (ms := cpu(lambda method=method: estimate_response(groups, method)))
        ],
    )


def applying() -> None:
    rng = np.random.default_rng(0)
    photo = rng.integers(0, 256, (3000, 4000, 3), dtype=np.uint8)
    linear = linearize(photo, dorf_mean())
    target = np.empty_like(linear)
    copy = cpu(lambda: np.copyto(target, linear))
    works = {
        "linearize, uint8": lambda: linearize(photo, dorf_mean()),
        "linearize, float32": lambda: linearize(linear, dorf_mean()),
        "reapply to uint8": lambda: reapply(linear, dorf_mean(), np.uint8),
        "reapply to float32": lambda: reapply(linear, dorf_mean()),
    }
    print(f"A curve on 3000 x 4000 RGB; a copy is np.copyto of it as float32, {copy:.0f} ms\n")
    rows = [(name, cpu(work)) for name, work in works.items()]
    table(
        ["work", "CPU ms", "copies"],
        [[name, f"{ms:.0f}", f"{ms / copy:.1f}"] for name, ms in rows],
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--every", type=int, default=1, metavar="N", help="take each N-th curve")
    every = parser.parse_args().every
    if not DATA.exists():
        print(f"{DATA} is not there: EMoR curves with random coefficients stand in for DoRF\n")
    curves = dorf_curves()
    truths = list(enumerate(curves))[::every]
    print(f"{len(truths)} responses\n")
    accuracy(truths)
    speed()
    applying()


if __name__ == "__main__":
    main()

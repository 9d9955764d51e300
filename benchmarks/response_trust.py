"""How far an estimate of the response can be trusted: ideal profiles, scenes, pictures, cameras.

    OMP_NUM_THREADS=1 python benchmarks/response_trust.py                # all of it, an hour
    OMP_NUM_THREADS=1 python benchmarks/response_trust.py --every 8 --cases 12

The default estimator beside fixed curves and Eq. 10 of Kim et al. 2012. The error is that of the
inverse response after the best affine alignment over the range of intensity that the profiles
cover. A prior of DoRF always leaves out the true curve and its near duplicates. Beside the errors
on ideal profiles stand the least ones to expect, of ``cramer_rao.py``. The suites of photos are
those of ``suites.py``: edges found automatically, JPEG, one response for all channels.
"""

import argparse
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
import suites
from cramer_rao import Bound, bound
from numpy.typing import NDArray
from response_estimation import cpu, shaken_profiles, table
from scipy import fft

from napari_crfdeblur import DeblurOptions, deblur
from napari_crfdeblur.edges import estimate_blur_extent, find_edges
from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import (
    GivenResponse,
    KnownPsf,
    MaximumLikelihood,
    PolynomialFit,
    RankMinimization,
    ResponseEstimate,
    ResponseFit,
    ResponseStatus,
    estimate_response,
)
from napari_crfdeblur.estimate.band import covered_range
from napari_crfdeblur.pipeline import profiles_for
from napari_crfdeblur.profiles import ProfileGroup
from napari_crfdeblur.progress import drain
from napari_crfdeblur.psf import GivenPsf
from napari_crfdeblur.quality import psnr, response_error
from napari_crfdeblur.response import (
    SRGB,
    Cameras,
    Emor,
    Gamma,
    Identity,
    ResponseCurve,
    ResponsePrior,
    dorf_mean,
)
from napari_crfdeblur.simulate import Camera, ProfileCase, random_profiles
from napari_crfdeblur.simulate.profiles import (
    constant_contrast,
    edge_shape,
    from_black,
    random_displacement,
    recorded,
)

Floats = NDArray[np.floating]
Profiles = list[ProfileGroup]
FIXED: dict[str, ResponseCurve] = {
    "identity": Identity(),
    "gamma 2.2": Gamma(2.2),
    "sRGB": SRGB(),
    "DoRF mean": dorf_mean(),
}
PAPER = RankMinimization(polynomial=PolynomialFit(resamples=0))
COLUMNS = {"prior": "bound", "alone": "without prior", "floor": "floor"}  # of bounds
DUPLICATE = 0.004  # rms difference of two responses of DoRF that are one film
IDEAL = {
    "4 groups x 8, 8 bit": (ProfileCase(groups=4), 0.0),
    "4 groups x 8, noise .005": (ProfileCase(groups=4), 0.005),
    "4 groups x 8, noise .01": (ProfileCase(groups=4), 0.01),
    "3 profiles, noise .005": (ProfileCase(profiles=3), 0.005),
    "8 from black, noise .005": (ProfileCase(levels=from_black), 0.005),
    "8 of constant contrast, noise .005": (ProfileCase(levels=constant_contrast), 0.005),
    "4 x 8, noise .005, 25 % bad": (ProfileCase(groups=4, bad=0.25), 0.005),
}


@dataclass
class Tally:
    """What came out for the cases of one suite."""

    errors: dict[str, list[float]] = field(default_factory=dict)
    inside: list[float] = field(default_factory=list)
    levels: list[tuple[ResponseStatus, float, float]] = field(default_factory=list)

    def add(self, name: str, error: float) -> None:
        self.errors.setdefault(name, []).append(error)

    def judge(self, found: ResponseEstimate, truth: ResponseCurve, error: float, guess: float):
        """Note whether the truth lies in the band, and what the level promised."""
        intensity = np.linspace(*found.covered, 65)
        light = truth.to_irradiance(intensity)
        lower, upper = (
            np.interp(intensity, found.intensity, b) for b in (found.lower, found.upper)
        )
        self.inside.append(float(np.mean((light >= lower) & (light <= upper))))
        self.levels.append((found.status, error, guess))


def without(truth: ResponseCurve) -> ResponsePrior:
    """What DoRF tells of a camera that is not in it."""
    light = np.linspace(0, 1, 257) ** 2
    own = truth.to_intensity(light)
    others = [
        curve
        for curve in suites.dorf_curves()
        if np.sqrt(np.mean((curve.to_intensity(light) - own) ** 2)) > DUPLICATE
    ]
    return ResponsePrior.from_curves(others)


def measure(
    tally: Tally,
    groups: Profiles,
    truth: ResponseCurve,
    methods: dict[str, tuple[ResponseFit, Profiles]],
    prior: ResponsePrior,
) -> None:
    """Errors of fixed curves, of the prior's mean and of every method; the last one is judged."""
    covered = covered_range(groups)
    for name, curve in {**FIXED, "prior": prior.curve()}.items():
        tally.add(name, response_error(curve, truth, covered))
    guess = tally.errors["prior"][-1]
    for name, (method, own) in methods.items():
        try:
            found = estimate_response(own, method)
        except CrfDeblurError:
            tally.add(name, response_error(dorf_mean(), truth, covered))
            continue
        error = response_error(found.curve, truth, covered)
        tally.add(name, error)
        if name == list(methods)[-1]:
            tally.judge(found, truth, error, guess)


def short(value: float) -> str:
    return f"{value:.4f}".removeprefix("0")


def errors_table(title: str, tallies: dict[str, Tally]) -> None:
    names = list(next(iter(tallies.values())).errors)
    print(f"{title}: mean / median\n")
    cells = {
        case: [f"{short(np.mean(v))} / {short(np.median(v))}" for v in tally.errors.values()]
        for case, tally in tallies.items()
    }
    table(["", "cases", *names], [[c, str(len(tallies[c].inside)), *v] for c, v in cells.items()])


def trust_table(tallies: dict[str, Tally], method: str) -> None:
    print(
        f"Trust in {method}: cases worse by more than .005 than the better of the DoRF mean and "
        "gamma 2.2, share of the covered range where the truth is in the 95 % band, and for each "
        "level the number of cases, their mean and worst error, and the share worse than the "
        "prior\n"
    )
    rows = []
    for case, tally in tallies.items():
        errors = np.array(tally.errors[method])
        best = np.minimum(tally.errors["DoRF mean"], tally.errors["gamma 2.2"])
        levels = []
        for level in ("GOOD", "DOUBTFUL", "CANNOT_TELL", "NOT_CONVERGED"):
            own = np.array([(e, g) for s, e, g in tally.levels if s.name == level])
            worse = np.mean(own[:, 0] > own[:, 1]) if len(own) else 0
            levels.append(
                f"{len(own)}: {short(own[:, 0].mean())}, {short(own[:, 0].max())}, {worse:.0%}"
                if len(own)
                else "-"
            )
        share = np.mean(errors > best + 0.005)
        rows.append([case, f"{share:.0%}", f"{np.mean(tally.inside):.0%}", *levels])
    table(["", "worse", "in band", "good", "doubtful", "cannot tell", "not converged"], rows)


def bounds_table(tallies: dict[str, Tally], bounds: dict[str, list[Bound]], method: str) -> None:
    print(
        f"Errors of {method} beside the bound of Cramer and Rao, with the prior and without, and "
        "the floor, mean / median; then the mean error over the mean bound, and over that of "
        "bound and floor together\n"
    )
    rows = []
    for case, own in bounds.items():
        errors = np.array(tallies[case].errors[method])
        least = {name: np.array([getattr(b, name) for b in own]) for name in COLUMNS}
        cells = [f"{short(v.mean())} / {short(np.median(v))}" for v in (errors, *least.values())]
        both = np.hypot(least["prior"], least["floor"])
        ratios = [f"{errors.mean() / v.mean():.2f}" for v in (least["prior"], both)]
        rows.append([case, str(len(own)), *cells, *ratios])
    table(["", "cases", method, *COLUMNS.values(), "/ bound", "/ bound and floor"], rows)


def ideal(every: int) -> None:
    tallies = {name: Tally() for name in IDEAL}
    bounds: dict[str, list[Bound]] = {name: [] for name in IDEAL}
    for name, (case, noise) in IDEAL.items():
        for seed, truth in list(enumerate(suites.dorf_curves()))[::every]:
            camera, prior = Camera(truth, noise=noise), without(truth)
            groups = random_profiles(camera, case, seed=seed)
            methods = {"Eq. 10": (PAPER, groups), "likelihood": (MaximumLikelihood(prior), groups)}
            measure(tallies[name], groups, truth, methods, prior)
            bounds[name].append(bound(camera, case, prior, covered_range(groups), seed=seed))
    errors_table("Ideal profiles, responses of DoRF, prior without the true one", tallies)
    trust_table(tallies, "likelihood")
    bounds_table(tallies, bounds, "likelihood")


def known_psf(every: int) -> None:
    tallies = {f"4 groups x 8, noise {short(noise)}": Tally() for noise in (0.0, 0.005, 0.01)}
    for tally, noise in zip(tallies.values(), (0.0, 0.005, 0.01), strict=True):
        for seed, truth in list(enumerate(suites.dorf_curves()))[::every]:
            camera = Camera(truth, noise=noise)
            psf, groups = shaken_profiles(camera, ProfileCase(groups=4), seed)
            prior, alone = without(truth), PolynomialFit(resamples=0)
            methods: dict[str, tuple[ResponseFit, Profiles]] = {
                "Eq. 4": (KnownPsf(psf, largest_shift=0, polynomial=alone), groups),
                "likelihood": (MaximumLikelihood(prior, psf), groups),
            }
            measure(tally, groups, truth, methods, prior)
    errors_table("Known PSF, likewise", tallies)


def figure_5(case: str, truth: ResponseCurve, seed: int) -> Profiles:
    """Profiles as in Fig. 5 of Kim et al. 2012: PSF of 15 px, one property at a time."""
    rng = np.random.default_rng([5, seed])
    noise = 0.02 if case.startswith("(c)") else 0.003
    bounds = (0.15, 0.6) if case.startswith("(d)") else (0.0, 1.0)
    groups = []
    for image in range(3 if case.startswith("(e)") else 1):
        position = np.arange(-14.0, 15.0)
        motion = random_displacement(rng, 15)
        low, high = np.sort(rng.uniform(*bounds, (2, 4 if case.startswith("(e)") else 8)), axis=0)
        high = np.minimum(np.maximum(high, low + 0.15), 1.0)
        sides = np.stack([low, high], axis=1)
        soft = rng.uniform(0, 3, len(sides)) if case.startswith("(b)") else np.zeros(len(sides))
        ramps = [np.add.outer(motion, np.linspace(-0.5, 0.5, 16) * s).ravel() for s in soft]
        shapes = np.array([edge_shape(position, ramp) for ramp in ramps])
        light = sides[:, :1] + np.diff(sides) * shapes
        angle = np.pi * image / 3
        groups.append(
            recorded(light, sides, Camera(truth, noise=noise), rng, averaged=16, orientation=angle)
        )
    return groups


FIGURE_5 = (
    "(a) varied ranges",
    "(b) soft edges up to 3 px",
    "(c) noise .02",
    "(d) range .15-.6",
    "(e) 3 images of 4 edges",
)


def paper_figure(every: int) -> None:
    tallies = {case: Tally() for case in FIGURE_5}
    for case, tally in tallies.items():
        for seed, truth in list(enumerate(suites.dorf_curves()))[::every]:
            groups, prior = figure_5(case, truth, seed), without(truth)
            methods = {"Eq. 10": (PAPER, groups), "likelihood": (MaximumLikelihood(prior), groups)}
            measure(tally, groups, truth, methods, prior)
    errors_table("The cases of Fig. 5 of the paper", tallies)


def photos(draw: Callable[[int], suites.Case], cases: Iterable[int], tally: Tally, tag: str):
    """Errors on photos of one suite, with edges found automatically."""
    for number in cases:
        case = draw(number)
        photo = case.photo
        edges = find_edges(photo, blur_extent=estimate_blur_extent(photo))
        default = MaximumLikelihood()
        groups = list(profiles_for(default, photo, edges))
        if not groups:
            continue
        own = without(case.truth)
        methods: dict[str, tuple[ResponseFit, Profiles]] = {
            "Eq. 10": (PAPER, list(profiles_for(PAPER, photo, edges))),
            "likelihood, DoRF": (MaximumLikelihood(own), groups),
            "likelihood": (default, groups),
        }
        measure(tally, groups, case.truth, methods, Cameras.DIGITAL.prior)
        print(f"<!-- {tag} {case.name}: {short(tally.errors['likelihood'][-1])} -->", flush=True)


def restored(draws: dict[str, Callable[[int], suites.Case]], cases: int) -> None:
    """PSNR of photos deblurred with their true PSF and with one response or another."""
    lost, gained = [], []
    for draw in draws.values():
        for number in range(cases):
            case = draw(number)
            found = deblur(case.photo, DeblurOptions(psf=GivenPsf(case.psf)))
            given = {
                name: deblur(
                    case.photo,
                    DeblurOptions(response=GivenResponse(curve), psf=GivenPsf(case.psf)),
                ).photo
                for name, curve in {"gamma": Gamma(2.2), "true": case.truth}.items()
            }
            scores = {name: psnr(photo, case.sharp) for name, photo in given.items()}
            own = psnr(found.photo, case.sharp)
            lost.append(scores["true"] - own)
            if response_error(Gamma(2.2), case.truth, found.responses[0].covered) > 0.03:
                gained.append(own - scores["gamma"])
    print(
        f"Photos deblurred with the true PSF, {len(lost)} cases: with the estimated response "
        f"{np.median(lost):.2f} dB less than with the true one (median; 90 % below "
        f"{np.quantile(lost, 0.9):.2f}). Where gamma 2.2 is wrong by more than .03, in "
        f"{len(gained)} cases, better than with gamma in "
        f"{np.mean(np.array(gained) > 0) if gained else np.nan:.0%}, by "
        f"{np.median(gained) if gained else np.nan:.2f} dB (median).\n"
    )


def speed() -> None:
    plane = np.random.default_rng(0).random((3072, 4096), dtype=np.float32)
    pair = cpu(lambda: fft.irfft2(fft.rfft2(plane), plane.shape))
    groups = random_profiles(
        Camera(Emor((1.5, -0.5)), noise=0.005), ProfileCase(groups=8, profiles=50), seed=0
    )
    prior = ResponsePrior(Cameras.DIGITAL.prior.mean, Cameras.DIGITAL.prior.directions[:5])
    works = {
        "likelihood, 12 directions, with band": MaximumLikelihood(),
        "likelihood, 5 directions, with band": MaximumLikelihood(prior),
        "Eq. 10, without band": PAPER,
    }
    print(
        "One estimate from 8 groups of 50 profiles of 41 samples, all starts; a pair is rfft2 + "
        f"irfft2 of 3072 x 4096 float32, {pair:.0f} ms of CPU\n"
    )
    times = {n: cpu(lambda m=m: estimate_response(groups, m), 3) for n, m in works.items()}
    live = drain(MaximumLikelihood().fitting(groups)).fits[0]
    first, *rest = groups
    fewer = [first.select(np.arange(1, len(first))), *rest]
    times["likelihood, 12 directions, live, without an edge"] = cpu(lambda: live.refit(fewer), 15)
    live = drain(MaximumLikelihood().fitting(fewer)).fits[0]
    times["likelihood, 12 directions, live, with an edge more"] = cpu(
        lambda: live.refit(groups), 15
    )
    table(
        ["method", "CPU ms", "pairs"],
        [[n, f"{ms:.0f}", f"{ms / pair:.2f}"] for n, ms in times.items()],
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--every", type=int, default=1, metavar="N", help="take each N-th curve")
    parser.add_argument("--cases", type=int, default=40, help="photos of each suite")
    parser.add_argument("--restored", type=int, default=8, help="photos of each that are deblurred")
    options = parser.parse_args()
    started = time.process_time()
    ideal(options.every)
    known_psf(options.every)
    paper_figure(options.every)
    available = suites.SUITES if suites.DATA.exists() else {"panels": suites.panels}
    tallies = {name: Tally() for name in available}
    for name, draw in available.items():
        photos(draw, range(options.cases), tallies[name], name)
    errors_table("Photos, edges found automatically", tallies)
    trust_table(tallies, "likelihood")
    restored(available, options.restored)
    speed()
    print(f"{time.process_time() - started:.0f} s of CPU")


if __name__ == "__main__":
    main()

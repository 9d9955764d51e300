"""Draw the cases of Fig. 5 of Kim et al. 2012: estimated curves beside the true ones.

    OMP_NUM_THREADS=1 python benchmarks/figure_5.py [--every 10] [FOLDER]

Of the cases that ``response_trust.py`` tabulates, one is drawn for each letter: the one where the
errors of both methods are nearest to their medians, and in a second picture to their 90 %
quantiles. The pictures go to docs/images unless another folder is given.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
import suites
from cramer_rao import irradiance_map
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from PIL import Image
from response_trust import FIGURE_5, PAPER, figure_5, short, without

from napari_crfdeblur.errors import CrfDeblurError
from napari_crfdeblur.estimate import MaximumLikelihood, ResponseEstimate, estimate_response
from napari_crfdeblur.estimate.band import TWO_SIDED_95, covered_range
from napari_crfdeblur.quality import STEPS, response_error
from napari_crfdeblur.report.colors import PAPER as COLORS
from napari_crfdeblur.report.curves import KNOTS
from napari_crfdeblur.response import ResponseCurve, dorf_mean

Floats = NDArray[np.floating]
IMAGES = Path(__file__).resolve().parents[1] / "docs" / "images"
PICTURES = {"response-figure-5.png": 0.5, "response-figure-5-hard.png": 0.9}  # their quantiles
STYLE = {"font.size": 8.0, "figure.dpi": 150}
COUNT = 64  # of the colors of a picture
EQ_10 = "#d55e00"
SMALL = 7.0  # points
LEAST_HEIGHT = 0.015  # of the lower axes, irradiance


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """Both estimates of one true response.

    Parameters
    ----------
    truth, paper : ResponseCurve
        The true response and that of Eq. 10.
    found : ResponseEstimate
        Of the likelihood.
    covered : (float, float)
        Range of intensity that the profiles cover.
    """

    truth: ResponseCurve
    paper: ResponseCurve
    found: ResponseEstimate
    covered: tuple[float, float]

    @property
    def errors(self) -> tuple[float, float]:
        """Of Eq. 10 and of the likelihood."""
        first, second = (
            response_error(curve, self.truth, self.covered)
            for curve in (self.paper, self.found.curve)
        )
        return first, second


def estimates(case: str, every: int) -> list[Shown]:
    """Both estimates of each N-th curve of DoRF in one of the cases."""
    found = []
    for seed, truth in list(enumerate(suites.dorf_curves()))[::every]:
        groups = figure_5(case, truth, seed)
        own = estimate_response(groups, MaximumLikelihood(without(truth)))
        try:
            paper = estimate_response(groups, PAPER).curve
        except CrfDeblurError:
            paper = dorf_mean()
        found.append(Shown(truth, paper, own, covered_range(groups)))
    return found


def nearest(cases: list[Shown], quantile: float) -> Shown:
    """The case where the errors of both methods are nearest, as ratios, to a quantile of theirs."""
    errors = np.log([case.errors for case in cases])
    apart = np.abs(errors - np.quantile(errors, quantile, axis=0)).sum(axis=1)
    return cases[int(np.argmin(apart))]


def draw_curves(ax: Axes, shown: Shown) -> None:
    """Inverse responses with both ends fixed, and the band of the estimate."""
    found = shown.found
    ax.axvspan(*shown.covered, color=COLORS.covered, linewidth=0, label="covered by edges")
    band = found.intensity, found.lower, found.upper
    ax.fill_between(
        *band, color=COLORS.one, alpha=0.22, linewidth=0, label="95 % band of likelihood"
    )
    ax.plot(KNOTS, shown.paper.to_irradiance(KNOTS), color=EQ_10, linewidth=1.1, label="Eq. 10")
    ax.plot(
        KNOTS, found.curve.to_irradiance(KNOTS), color=COLORS.one, linewidth=1.4, label="likelihood"
    )
    truth = shown.truth.to_irradiance(KNOTS)
    ax.plot(KNOTS, truth, color=COLORS.ink, linewidth=1.1, dashes=(3, 2), label="true response")
    ax.set(xlim=(0, 1), ylim=(0, 1), xticks=[0, 0.5, 1], xticklabels=[], yticks=[0, 0.5, 1])
    _tidy(ax)


def draw_errors(ax: Axes, shown: Shown, height: float) -> None:
    """What is left of both estimates after the best affine alignment, over the covered range."""
    intensity = np.linspace(*shown.covered, STEPS)
    own = left(shown.found.curve, shown)
    posterior = shown.found.posterior
    if posterior is not None:
        change = irradiance_map(posterior.curve(), posterior, shown.covered)
        width = TWO_SIDED_95 * np.sqrt(np.sum(change**2, axis=1))
        band = intensity, own - width, own + width
        ax.fill_between(*band, color=COLORS.one, alpha=0.22, linewidth=0)
    ax.axvspan(*shown.covered, color=COLORS.covered, linewidth=0, zorder=0)
    ax.plot(intensity, left(shown.paper, shown), color=EQ_10, linewidth=1.1)
    ax.plot(intensity, own, color=COLORS.one, linewidth=1.4)
    ax.axhline(0, color=COLORS.ink, linewidth=1.1, dashes=(3, 2))
    ax.set(xlim=(0, 1), xticks=[0, 0.5, 1], ylim=(-height, height))
    ax.yaxis.set_major_locator(MaxNLocator(3, symmetric=True))
    _tidy(ax)


def left(curve: ResponseCurve, shown: Shown) -> Floats:
    """``a g(I) + b - g_true(I)`` with the best `a` and `b`, over the covered range."""
    intensity = np.linspace(*shown.covered, STEPS)
    light, truth = curve.to_irradiance(intensity), shown.truth.to_irradiance(intensity)
    design = np.stack([light, np.ones_like(light)], axis=1)
    scale, *_ = np.linalg.lstsq(design, truth, rcond=None)
    return design @ scale - truth


def draw(cases: dict[str, Shown]) -> Figure:
    """A panel for each case, and the legend in the place of a sixth."""
    figure = Figure(figsize=(8.6, 6.6), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.06, h_pad=0.03)
    errors = [np.abs(left(shown.found.curve, shown)) for shown in cases.values()]
    # The last steps to white would dwarf all else.
    height = max(LEAST_HEIGHT, 1.5 * float(np.quantile(errors, 0.95)))
    rows = figure.add_gridspec(5, 3, height_ratios=(3, 1.3, 0.12, 3, 1.3))
    for number, (name, shown) in enumerate(cases.items()):
        row, column = divmod(number, 3)
        curves = figure.add_subplot(rows[3 * row, column])
        rest = figure.add_subplot(rows[3 * row + 1, column])
        draw_curves(curves, shown)
        draw_errors(rest, shown, height)
        paper, own = (short(error) for error in shown.errors)
        curves.set_title(name, fontsize=8.5, color=COLORS.ink, loc="left", pad=15)
        said = f"error: Eq. 10 {paper}, likelihood {own}"
        place = {"transform": curves.transAxes, "fontsize": SMALL, "color": COLORS.pale}
        curves.text(0, 1.04, said, **place)
        rest.set_xlabel("recorded intensity", fontsize=7.5, color=COLORS.ink)
        if column == 0:
            curves.set_ylabel("relative irradiance", fontsize=7.5, color=COLORS.ink)
            rest.set_ylabel("error, aligned", fontsize=7.5, color=COLORS.ink)
    key = figure.add_subplot(rows[3:, 2])
    key.axis("off")
    handles, names = curves.get_legend_handles_labels()
    key.legend(handles[::-1], names[::-1], loc="center", frameon=False, labelcolor=COLORS.ink)
    return figure


def save(figure: Figure, path: Path) -> None:
    """As a picture of few colors: enough for lines, at a third of the size."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    picture.quantize(COUNT).save(path, optimize=True)


def _tidy(ax: Axes) -> None:
    ax.tick_params(labelsize=SMALL, labelcolor=COLORS.pale, length=2, color=COLORS.pale)
    ax.spines[:].set(linewidth=0.5, color=COLORS.pale)
    ax.spines[["top", "right"]].set_visible(False)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=IMAGES, help="of the pictures")
    parser.add_argument("--every", type=int, default=10, metavar="N", help="take each N-th curve")
    options = parser.parse_args()
    found = {case: estimates(case, options.every) for case in FIGURE_5}
    with mpl.rc_context(STYLE):
        for name, quantile in PICTURES.items():
            figure = draw({case: nearest(own, quantile) for case, own in found.items()})
            save(figure, options.folder / name)


if __name__ == "__main__":
    main()

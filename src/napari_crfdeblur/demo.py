"""A known street, blurred and recovered: what the response buys, in figures and pictures."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ._typing import Image
from .deconvolution import LocalShrinkage, deconvolving
from .estimate import GivenResponse
from .io import Output, Outputs, write_photo, write_psf, write_responses, write_text
from .pipeline import Deblurred, deblurring
from .progress import Job
from .psf import camera_shake
from .quality import aligned, kernel_similarity, psnr, response_error, ringing, ssim
from .report import Report, write_report
from .response import Gamma, GeneralizedGamma, Identity, ResponseCurve, linearizing, reapplying
from .simulate import Camera, Simulated, simulate, street

# A camera whose contrast is stronger than gamma 2.2 allows for: the local exponent goes from
# 1.2 in the shadows to 3 in the highlights.
RESPONSE = GeneralizedGamma((0.85, -0.75, 0.25))
SHAPE = 800, 1200
PSF_SIZE = 15
NOISE = 0.003
TRIALS = ("identity", "gamma 2.2", "estimated", "true")  # responses that are compared


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One response to assume, and the photo deblurred with it and the true PSF.

    Parameters
    ----------
    name : str
        Of the response.
    curve : ResponseCurve
        The response.
    photo : ndarray
        Deblurred.
    error : float
        Of the response (affine-aligned RMSE over the range that the edges cover).
    psnr, ssim, ringing : float
        Of the photo, against the sharp truth; ringing needs no truth.
    """

    name: str
    curve: ResponseCurve
    photo: Image
    error: float
    psnr: float
    ssim: float
    ringing: float


@dataclass(frozen=True, slots=True, eq=False)
class Demonstration:
    """Truth, the whole path from the photo alone, and the four responses compared.

    Parameters
    ----------
    truth : Simulated
    whole : Deblurred
        From the photo alone, PSF estimated too.
    blurred_psnr, whole_psnr : float
        Of the photo as it was taken, and of that result, in dB.
    trials : tuple of Trial
    """

    truth: Simulated
    whole: Deblurred
    blurred_psnr: float
    whole_psnr: float
    trials: tuple[Trial, ...]


def demonstrating(seed: int = 0) -> Job[Demonstration]:
    """Long job: simulate, deblur from the photo alone, and compare the responses."""
    psf = camera_shake(PSF_SIZE, seed)
    rows, columns = (side + reach - 1 for side, reach in zip(SHAPE, psf.shape, strict=True))
    camera = Camera(RESPONSE, noise=NOISE)
    truth = simulate(street((rows, columns), seed=seed), psf, camera, seed=seed)
    whole = yield from deblurring(truth.photo)
    estimate = whole.responses[0]
    curves = Identity(), Gamma(2.2), estimate.curve, RESPONSE
    trials = []
    for name, curve in zip(TRIALS, curves, strict=True):
        trials.append((yield from _trying(name, curve, truth, estimate.covered)))
    blurred, restored = (psnr(photo, truth.sharp) for photo in (truth.photo, whole.photo))
    return Demonstration(truth, whole, blurred, restored, tuple(trials))


def _trying(
    name: str, curve: ResponseCurve, truth: Simulated, covered: tuple[float, float]
) -> Job[Trial]:
    linear = yield from linearizing(truth.photo, curve)
    sharp_linear = yield from deconvolving(linear, truth.psf, LocalShrinkage())
    photo = yield from reapplying(sharp_linear, curve, truth.photo.dtype)
    pair = aligned(photo, truth.sharp)
    return Trial(
        name=name,
        curve=curve,
        photo=photo,
        error=response_error(curve, truth.camera.response, covered),
        psnr=psnr(*pair, border=0),
        ssim=ssim(*pair, border=0),
        ringing=ringing(photo, truth.photo, extent=PSF_SIZE),
    )


def table(result: Demonstration) -> str:
    """The comparison as a Markdown table, and the whole path in a sentence."""
    lines = [
        "| response  | its error | PSNR, dB | SSIM  | ringing |",
        "|-----------|----------:|---------:|------:|--------:|",
    ]
    lines += [
        f"| {t.name:<9} | {t.error:9.4f} | {t.psnr:8.2f} | {t.ssim:5.3f} | {t.ringing:7.2f} |"
        for t in result.trials
    ]
    similarity = kernel_similarity(result.whole.psf.psf, result.truth.psf)
    return "\n".join(
        [
            *lines,
            "",
            "Response error: RMSE after the best affine alignment, over the range of the edges.",
            "PSNR and SSIM: the photo deblurred with that response and the true PSF.",
            f"Blurred photo: {result.blurred_psnr:.2f} dB.",
            f"From the photo alone, PSF estimated too: {result.whole_psnr:.2f} dB, "
            f"PSF similarity {similarity:.2f}.",
        ]
    )


def writing_demo(folder: Path) -> Outputs:
    """All that :func:`write` writes to a folder, which is made if it is missing."""
    names = [f"{name}.png" for name in ("blurred", "sharp", "deblurred", "before-after")]
    names += [_picture(trial) for trial in TRIALS]
    names += ["psf-true.png", "psf-estimated.png"]
    names += ["response-true.json", "response-estimated.json", "table.md", "report.html"]
    planned = [Output(folder / name, (Path(name).suffix,)) for name in names]
    return Outputs((), planned, [folder])


def write(result: Demonstration, folder: Path, outputs: Outputs) -> None:
    """Write the pictures, the PSFs, the response, the table and a report to a folder.

    Parameters
    ----------
    result : Demonstration
    folder : Path
    outputs : Outputs
        Of that folder, entered: its files appear at the end of it.
    """
    truth, whole = result.truth, result.whole

    def at(name: str) -> Path:
        return outputs[folder / name]

    write_photo(at("blurred.png"), truth.photo)
    write_photo(at("sharp.png"), truth.sharp)
    write_photo(at("deblurred.png"), whole.photo)
    for trial in result.trials:
        write_photo(at(_picture(trial.name)), trial.photo)
    write_photo(at("before-after.png"), before_after(result))
    write_psf(at("psf-true.png"), truth.psf)
    write_psf(at("psf-estimated.png"), whole.psf.psf)
    write_responses(at("response-true.json"), [GivenResponse(RESPONSE).estimate()])
    write_responses(at("response-estimated.json"), whole.responses)
    write_text(at("table.md"), table(result) + "\n")
    write_report(at("report.html"), _report(result))


def _picture(trial: str) -> str:
    return f"deblurred-{trial.replace(' ', '-')}.png"


def _report(result: Demonstration) -> Report:
    truth, whole = result.truth, result.whole
    return Report(
        title="A known street, blurred and recovered",
        photo=truth.photo,
        edges=whole.edges,
        groups=whole.groups,
        responses=whole.responses,
        psf=whole.psf,
        sharp=whole.photo,
        references={"gamma 2.2": Gamma(2.2), "true": RESPONSE},
        figures={f"PSNR, {trial.name}": f"{trial.psnr:.2f} dB" for trial in result.trials},
    )


def before_after(result: Demonstration) -> Image:
    """The blurred photo, deblurred as if linear and in linear light: a strip of three."""
    rows, columns = SHAPE
    window = slice(rows // 8, rows * 5 // 8), slice(columns * 4 // 10, columns * 7 // 10)
    trials = {trial.name: trial.photo for trial in result.trials}
    shown = [result.truth.photo, trials["identity"], trials["estimated"]]
    gap = np.full((window[0].stop - window[0].start, 8, 3), 255, dtype=np.uint8)
    parts = [part for photo in shown for part in (photo[window], gap)]
    return np.concatenate(parts[:-1], axis=1)

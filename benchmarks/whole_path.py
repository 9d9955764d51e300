"""From a blurred photo to a deblurred one: what each response buys, with and without the PSF.

Streets drawn at random, blurred by a camera shake and recorded with one of four responses,
some as JPEG. Edges are found automatically. Prints the error of each response and the PSNR of
the photo deblurred with it: with the true PSF, and with the PSF found from the photo.

    python benchmarks/whole_path.py [--cases N]
"""

import argparse
import time
from dataclasses import dataclass

from napari_crfdeblur import DeblurOptions, deblur
from napari_crfdeblur.edges import estimate_blur_extent, find_edges
from napari_crfdeblur.estimate import GivenResponse, MaximumLikelihood, estimate_response
from napari_crfdeblur.pipeline import profiles_for
from napari_crfdeblur.psf import GivenPsf, camera_shake
from napari_crfdeblur.quality import psnr, response_error
from napari_crfdeblur.response import SRGB, Emor, Gamma, GeneralizedGamma, Identity, dorf_mean
from napari_crfdeblur.simulate import Camera, Simulated, simulate, street

RESPONSES = {
    "strong": GeneralizedGamma((0.85, -0.75, 0.25)),
    "gamma 1.5": Gamma(1.5),
    "EMoR 2, -.5": Emor((2, -0.5)),
    "sRGB": SRGB(),
}
SIZES = 15, 21, 31
SHAPE = 800, 1200
NOISE = 0.003
COLUMNS = ("identity", "gamma 2.2", "DoRF mean", "estimated", "true")


@dataclass(frozen=True)
class Case:
    """One street, one shake, one camera."""

    number: int

    @property
    def size(self) -> int:
        return SIZES[self.number % len(SIZES)]

    @property
    def response(self) -> str:
        return list(RESPONSES)[self.number % len(RESPONSES)]

    @property
    def jpeg(self) -> int | None:
        return (None, 95)[self.number // 2 % 2]

    def photo(self) -> Simulated:
        psf = camera_shake(self.size, self.number)
        rows, columns = (side + self.size - 1 for side in SHAPE)
        camera = Camera(RESPONSES[self.response], noise=NOISE, jpeg=self.jpeg)
        scene = street((rows, columns), seed=self.number)
        return simulate(scene, psf, camera, seed=self.number)

    def __str__(self) -> str:
        jpeg = f", JPEG {self.jpeg}" if self.jpeg else ""
        return f"{self.number}: {self.response}, {self.size} px{jpeg}"


def measured(case: Case) -> tuple[list[str], list[str], list[str]]:
    """Cells of one case: response errors, PSNR with the true PSF, PSNR with the found one."""
    truth = case.photo()
    edges = find_edges(truth.photo, blur_extent=estimate_blur_extent(truth.photo))
    method = MaximumLikelihood()
    estimate = estimate_response(profiles_for(method, truth.photo, edges), method)
    curves = dict(
        zip(
            COLUMNS,
            (Identity(), Gamma(2.2), dorf_mean(), estimate.curve, truth.camera.response),
            strict=True,
        )
    )
    errors, given, blind = [], [], []
    for name, curve in curves.items():
        response = GivenResponse(curve)
        with_psf = deblur(truth.photo, DeblurOptions(response=response, psf=GivenPsf(truth.psf)))
        alone = deblur(truth.photo, DeblurOptions(response=response))
        error = response_error(curve, truth.camera.response, estimate.covered)
        errors.append(f"{error:.4f}" if name != "true" else "0")
        given.append(f"{psnr(with_psf.photo, truth.sharp):.2f}")
        blind.append(f"{psnr(alone.photo, truth.sharp):.2f}")
    blurred = f"{psnr(truth.photo, truth.sharp):.2f}"
    return [*errors, estimate.status.name.lower()], [blurred, *given], [blurred, *blind]


def table(title: str, columns: tuple[str, ...], rows: dict[str, list[str]]) -> str:
    head = f"| {title} | " + " | ".join(columns) + " |"
    body = [f"| {name} | " + " | ".join(cells) + " |" for name, cells in rows.items()]
    return "\n".join([head, "|---" * (len(columns) + 1) + "|", *body, ""])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=4, help="number of photos (default: 4)")
    cases = [Case(number) for number in range(parser.parse_args().cases)]
    started = time.process_time()
    results = {str(case): measured(case) for case in cases}
    names = "response error", "PSNR with the true PSF, dB", "PSNR with the found PSF, dB"
    for index, name in enumerate(names):
        columns = (*COLUMNS, "status") if index == 0 else ("blurred", *COLUMNS)
        print(table(name, columns, {case: cells[index] for case, cells in results.items()}))
    print(f"{time.process_time() - started:.0f} s of CPU for {len(cases)} photos")


if __name__ == "__main__":
    main()

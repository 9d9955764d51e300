"""The command ``crfdeblur``: what it writes, and what it says when it cannot."""

import json
import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from napari_crfdeblur.cli import main
from napari_crfdeblur.io import read_photo, read_psf, write_photo, write_psf
from napari_crfdeblur.psf import camera_shake
from napari_crfdeblur.quality import psnr
from napari_crfdeblur.response import GeneralizedGamma
from napari_crfdeblur.simulate import Camera, simulate, slanted_edges

RESPONSE = GeneralizedGamma((0.85, -0.75, 0.25))
EXTENT = 13  # of the blurred edges


@pytest.fixture(scope="module")
def simulated():
    scene = slanted_edges((206, 276), seed=3, pitch=92, channels=3)
    return simulate(scene, camera_shake(9, 4), Camera(RESPONSE, noise=0.002), seed=5)


def run(*arguments):
    return main([str(a) for a in arguments])


@pytest.fixture(scope="module")
def made(tmp_path_factory, simulated):
    """A folder with a blurred photo, its sharp truth, its PSF, its edges and its response."""
    folder = tmp_path_factory.mktemp("made")
    photo = folder / "photo.png"
    write_photo(photo, simulated.photo)
    write_photo(folder / "sharp.png", simulated.sharp)
    write_psf(folder / "psf.npy", simulated.psf)
    files = ["-o", folder / "camera.json", "--save-edges", folder / "edges.json"]
    assert run("estimate", photo, "--blur-extent", EXTENT, *files) == 0
    return folder


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch, made):
    """A copy of that folder, in which the command runs."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)


def refused(capsys, *arguments):
    """The one sentence of a refusal; nothing but the inputs is left behind."""
    before = {p: p.read_bytes() for p in Path().iterdir() if p.is_file()}
    assert run(*arguments) == 2
    after = {p: p.read_bytes() for p in Path().iterdir() if p.is_file()}
    assert after == before
    error = capsys.readouterr().err
    assert error.startswith("crfdeblur: ")
    assert error.count("\n") == 1
    assert "Traceback" not in error
    return error


def test_deblur_with_known_psf_sharpens_the_photo(simulated, capsys):
    code = run(
        "deblur",
        "photo.png",
        "--psf",
        "psf.npy",
        "--blur-extent",
        EXTENT,
        "-o",
        "out.png",
        "--report",
        "report.html",
        "--save-edges",
        "found.json",
    )
    assert code == 0
    sharp = psnr(read_photo(Path("out.png")), simulated.sharp)
    # Deconvolution with the true PSF gains many dB; 4 would be missed by any wrong step.
    assert sharp > psnr(simulated.photo, simulated.sharp) + 4
    assert "wrote out.png" in capsys.readouterr().out
    assert Path("report.html").stat().st_size > 10_000
    assert json.loads(Path("found.json").read_text())["edges"]


def test_an_estimated_response_serves_other_photos(simulated):
    content = json.loads(Path("camera.json").read_text())
    assert content["format"] == "crfdeblur-response"
    assert content["version"] == 1
    assert content["direction"] == "inverse"
    channel = content["channels"][0]
    names = {"name", "intensity", "irradiance", "lower", "upper", "covered", "status", "findings"}
    assert names <= set(channel)
    assert run("deblur", "photo.png", "--psf", "psf.npy", "--response", "camera.json") == 0
    out = read_photo(Path("photo-deblurred.png"))
    assert psnr(out, simulated.sharp) > psnr(simulated.photo, simulated.sharp) + 4


def test_several_photos_are_pooled():
    write_photo(Path("again.tif"), read_photo(Path("photo.png"))[100::-1])
    assert run("estimate", "photo.png", "again.tif", "--blur-extent", EXTENT, "-o", "one.json") == 0
    both = json.loads(Path("one.json").read_text())["channels"][0]["diagnostics"]
    one = json.loads(Path("camera.json").read_text())["channels"][0]["diagnostics"]
    assert both["profiles"] > one["profiles"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["--method", "rank"],
        ["--method", "rank-all"],
        ["--method", "mean"],
        ["--method", "known-psf", "--psf", "psf.npy"],
        ["--method", "likelihood", "--psf", "psf.npy"],
        ["--prior", "dorf"],
        ["--prior", "SRGB", "--per-channel"],
        ["--prior", "camera.json"],
    ],
    ids=" ".join,
)
def test_every_estimator_and_prior_can_be_named(arguments):
    found = json.loads(Path("edges.json").read_text())
    Path("few.json").write_text(json.dumps(found | {"edges": found["edges"][::2]}))
    files = ["--edges", "few.json", "-o", "other.json"]
    assert run("estimate", "photo.png", "--blur-extent", EXTENT, *files, *arguments) == 0
    channels = json.loads(Path("other.json").read_text())["channels"]
    assert len(channels) == (3 if "--per-channel" in arguments else 1)


@pytest.mark.parametrize(
    "method",
    ["hyper-laplacian", "local-shrinkage", "irls", "total-variation", "richardson-lucy", "wiener"],
)
def test_every_deconvolution_can_be_named(method):
    small = read_photo(Path("photo.png"))[:80, :100]
    write_photo(Path("small.jpg"), small)
    code = run("deblur", "small.jpg", "--psf", "psf.npy", "--response", "srgb", "--method", method)
    assert code == 0
    assert read_photo(Path("small-deblurred.jpg")).shape == small.shape


def test_psf_writes_a_psf():
    small = read_photo(Path("photo.png"))[:100, :130]
    write_photo(Path("small.png"), small)
    code = run("psf", "small.png", "--response", "gamma:1.5", "--psf-size", 9, "-o", "k.tif")
    assert code == 0
    psf = read_psf(Path("k.tif"))
    assert psf.min() >= 0
    assert psf.sum() == pytest.approx(1)


@pytest.mark.parametrize(
    ("command", "edges"), [("psf", ["--from", "edges"]), ("deblur", ["--psf", "edges"])]
)
def test_the_psf_can_be_found_from_edges_alone(simulated, capsys, command, edges):
    known = ["--response", "gamma:1.5", "--edges", "edges.json", "--blur-extent", EXTENT]
    size = ["--psf-size", 9, "--report", "report.html", "-o", "out.png"]
    assert run(command, "photo.png", *known, *edges, *size) == 0
    said = capsys.readouterr().out
    assert "PSF: " in said
    assert "wrote out.png" in said
    assert "PSF, orientations" in Path("report.html").read_text(encoding="utf-8")
    if command == "deblur":
        assert read_photo(Path("out.png")).shape == simulated.photo.shape


def test_nothing_is_said_of_a_range_that_no_edge_covers(capsys):
    smooth = np.linspace(40, 200, 160 * 210).reshape(160, 210).astype(np.uint8)
    write_photo(Path("smooth.png"), smooth)
    known = ["--psf", "psf.npy", "--blur-extent", EXTENT, "--report", "report.html"]
    assert run("deblur", "smooth.png", *known, "-o", "out.png") == 0
    said = capsys.readouterr().out
    assert "response: the edges cannot tell the response" in said
    assert "(intensity" not in said
    assert "covered intensity" not in Path("report.html").read_text(encoding="utf-8")


def test_simulate_writes_the_truth_beside_the_photo():
    assert (
        run(
            "simulate",
            "-o",
            "new.png",
            "--scene",
            "slanted",
            "--size",
            "100x140",
            "--psf",
            "disk",
            "--psf-size",
            7,
            "--response",
            "srgb",
        )
        == 0
    )
    assert read_photo(Path("new.png")).shape[:2] == (100, 140)
    assert read_photo(Path("new-sharp.png")).shape[:2] == (100, 140)
    assert read_psf(Path("new-psf.npy")).shape == (7, 7)
    assert json.loads(Path("new-response.json").read_text())["direction"] == "inverse"


def test_a_camera_that_turns_is_simulated_and_undone(capsys):
    made = ["--size", "130x180", "--psf-size", 7, "--turn", 1.5, "--response", "srgb"]
    assert run("simulate", "-o", "turned.png", "--scene", "slanted", *made) == 0
    assert read_photo(Path("turned.png")).shape[:2] == (130, 180)
    known = ["--response", "srgb", "--psf", "xu-jia", "--psf-size", 9, "--report", "r.html"]
    assert run("deblur", "turned.png", *known, "--varying", "2x3", "-o", "out.png") == 0
    said = capsys.readouterr().out
    assert "of 6 tell their PSF" in said
    assert "PSFs across the photo" in Path("r.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("content", "advice"),
    [
        (None, "no such file"),
        (b"", "not a PNG, JPEG or TIFF"),
        (b"hello", "not a PNG, JPEG or TIFF"),
        (b"GIF89a" + bytes(40), "not a PNG, JPEG or TIFF"),
        (b"\x89PNG\r\n\x1a\n" + bytes(40), "truncated or damaged"),
        (b"\xff\xd8\xff\xe0" + bytes(40), "truncated or damaged"),
        (b"II*\0" + bytes(40), "truncated or damaged"),
    ],
    ids=["missing", "empty", "text", "gif", "png", "jpeg", "tiff"],
)
@pytest.mark.parametrize("command", ["deblur", "estimate", "psf"])
def test_a_file_that_is_no_photo_is_refused(capsys, command, content, advice):
    if content is not None:
        Path("bad.png").write_bytes(content)
    assert advice in refused(capsys, command, "bad.png")


@pytest.mark.parametrize(
    ("photo", "advice"),
    [
        (np.zeros((1, 1), dtype=np.uint8), "at least 8"),
        (np.full((40, 50), 77, dtype=np.uint8), "constant"),
        (np.full((40, 50, 3), 255, dtype=np.uint8), "saturated"),
        (np.full((40, 50), np.nan, dtype=np.float32), "finite"),
    ],
    ids=["pixel", "constant", "saturated", "nan"],
)
def test_a_photo_without_content_is_refused(capsys, photo, advice):
    write_photo(Path("bad.tif"), photo)
    assert advice in refused(capsys, "deblur", "bad.tif", "--psf", "psf.npy", "-o", "out.png")


@pytest.mark.parametrize(
    ("psf", "advice"),
    [
        (np.ones((999, 3)), "larger than the image"),
        (-np.ones((3, 3)), "negative"),
        (np.zeros((5, 5)), "zero"),
        (np.full((5, 5), np.nan), "finite"),
        (np.ones((5, 5, 3)), "grayscale"),
    ],
    ids=["large", "negative", "zero", "nan", "color"],
)
def test_a_psf_that_is_none_is_refused(capsys, psf, advice):
    np.save("bad.npy", psf)
    error = refused(capsys, "deblur", "photo.png", "--psf", "bad.npy", "--response", "srgb")
    assert advice in error


@pytest.mark.parametrize(
    ("change", "advice"),
    [
        ({"direction": "forward"}, "direction"),
        ({"format": "something"}, "not a response file"),
        ({"channels": []}, "channels"),
        ({"channels": [{"intensity": [0, 0.5, 1], "irradiance": [0, 0, 1]}]}, "increase"),
    ],
)
def test_a_response_file_that_is_none_is_refused(capsys, change, advice):
    content = {
        "format": "crfdeblur-response",
        "version": 1,
        "direction": "inverse",
        "channels": [{"intensity": [0, 0.5, 1], "irradiance": [0, 0.2, 1]}],
    }
    Path("bad.json").write_text(json.dumps(content | change))
    error = refused(capsys, "deblur", "photo.png", "--psf", "psf.npy", "--response", "bad.json")
    assert advice in error


@pytest.mark.parametrize(
    ("arguments", "advice"),
    [
        (["deblur", "photo.png", "-o", "missing/out.png"], "no such folder"),
        (["deblur", "photo.png", "-o", "out.xyz"], "kind of file"),
        (["deblur", "photo.png", "-o", "photo.png"], "is read by this run"),
        (["deblur", "photo.png", "--response", "gamma:x"], "no response"),
        (["deblur", "photo.png", "--response", "gamma:-1"], "exponent"),
        (["deblur", "photo.png", "--report", "report.doc"], "kind of file"),
        (["estimate", "photo.png", "--method", "known-psf"], "--psf"),
        (["estimate", "photo.png", "-o", "out.txt"], "kind of file"),
        (["estimate", "photo.png", "--method", "mean", "--psf", "psf.npy"], "leave out --psf"),
        (["estimate", "photo.png", "--method", "rank", "--prior", "srgb"], "leave out --prior"),
        (["estimate", "photo.png", "--prior", "digtal"], "no kind of camera: write digital"),
        (["estimate", "photo.png", "--prior", "gone.json"], "no such file"),
        (["deblur", "photo.png", "--response", "srgb", "--prior", "dorf"], "leave out --response"),
        (["psf", "photo.png", "--response", "srgb", "--prior", "dorf"], "leave out --response"),
        (["simulate", "-o", "new.png", "--turn", 1, "--psf", "disk"], "leave out --psf"),
        (["demo", "-o", "photo.png/demo"], "folder"),
    ],
)
def test_what_cannot_be_done_is_refused_before_any_work(capsys, arguments, advice):
    assert advice in refused(capsys, *arguments)


def test_an_output_of_a_failed_run_is_not_destroyed(capsys):
    Path("out.png").write_bytes(b"precious")
    refused(capsys, "deblur", "sharp.png", "--psf", "missing.npy", "-o", "out.png")
    assert Path("out.png").read_bytes() == b"precious"


@pytest.mark.parametrize("command", ["demo", "deblur", "estimate", "psf", "simulate"])
def test_every_command_has_help(command, capsys):
    with pytest.raises(SystemExit) as exit_:
        run(command, "--help")
    assert exit_.value.code == 0
    assert "example" in capsys.readouterr().out


def test_ctrl_c_ends_in_a_sentence_and_leaves_nothing():
    big = np.random.default_rng(0).integers(0, 255, (900, 1200, 3), dtype=np.uint8)
    write_photo(Path("big.png"), big)
    before = set(Path().iterdir())
    known = ["--psf", "psf.npy", "--response", "srgb", "--method", "irls", "-o", "out.png"]
    terminal, inside = os.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "napari_crfdeblur.cli", "deblur", "big.png", *known], stderr=inside
    )
    os.close(inside)
    said = b""
    while b"]" not in said:  # until the bar shows that the work goes on, far from the end
        said += os.read(terminal, 1024)
    process.send_signal(signal.SIGINT)
    with suppress(OSError):  # no more to read
        while more := os.read(terminal, 1024):
            said += more
    os.close(terminal)
    assert process.wait(timeout=60) == 2
    *bars, last = said.decode().removesuffix("\r\n").split("\r")
    assert last.startswith("crfdeblur: stopped")
    assert all(bar.strip() == "" or bar.startswith("[") for bar in bars)
    assert set(Path().iterdir()) == before

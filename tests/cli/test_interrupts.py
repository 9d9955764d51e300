"""A run that is cut short at any moment leaves everything whole, and says so if it can."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from small_runs import KNOWN

from napari_crfdeblur.io import write_photo
from napari_crfdeblur.io.places import PREFIX

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")

STOPPED = "crfdeblur: stopped; no file was left half written, so start again when you like\n"
STAGES = ["napari_crfdeblur.cli.commands"]
WITH_ZARR = [*STAGES, "zarr", "dask.array", "distributed"]
DEBLUR = ["deblur", "photo.png", "-o", "out.png", "--edges", "edges.json", *KNOWN]
DEBLUR += ["--save-edges", "found.csv"]
TILES = ["deblur", "photo.png", "-o", "out.zarr", *KNOWN]
SIMULATE = ["simulate", "-o", "new.png", "--size", "64x64", "--scene", "step", "--psf", "psf.png"]
SIMULATE += ["--response", "srgb"]
BATCH = ["batch", "a.png", "b.png", "c.png", "-o", "out", *KNOWN]


@pytest.fixture
def start(tmp_path, inputs):
    """The folder as it is before each run: with inputs and with old outputs."""
    folder = tmp_path / "start"
    shutil.copytree(inputs, folder)
    for name in ("out.png", "found.csv", "new.png", "new-psf.npy"):
        (folder / name).write_bytes(b"old")
    noise = np.random.default_rng(1).integers(0, 255, (3, 40, 52), dtype=np.uint8)
    for name, pixels in zip("abc", noise, strict=True):
        write_photo(folder / f"{name}.png", pixels)
    return folder


@pytest.fixture(scope="module")
def program():
    """The program that cuts runs short; one for all that want the same loaded."""
    programs = {}

    def started(loaded):
        if loaded not in programs:
            programs[loaded] = subprocess.Popen(
                [sys.executable, Path(__file__).with_name("cut_short.py"), *loaded],
                env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        return programs[loaded]

    yield started
    for each in programs.values():
        each.communicate()
        assert each.returncode == 0


@pytest.fixture
def cut_short(start, program):
    """How runs end that are cut short at so many moments, and the whole one."""

    def asked(line, way, moments, *, loaded=STAGES, seed=0, again=False):
        one = program(tuple(loaded))
        question = {"folder": str(start), "line": line, "way": way, "moments": moments}
        print(json.dumps(question | {"seed": seed, "again": again}), file=one.stdin, flush=True)
        found = json.loads(one.stdout.readline())
        assert found["whole"]["code"] == 0, found["whole"]
        assert found["whole"]["said"] == ""
        return found

    return asked


@pytest.mark.parametrize(
    ("line", "way", "moments", "loaded"),
    [
        (DEBLUR, "once", 50, STAGES),
        (DEBLUR, "again", 8, STAGES),
        (DEBLUR, "once", 3, []),  # also while our own stages are loaded
        (SIMULATE, "again", 4, STAGES),
        (TILES, "once", 4, WITH_ZARR),
        (BATCH, "again", 6, STAGES),
    ],
    ids=["deblur", "deblur, again", "loading", "simulate, again", "zarr", "batch, again"],
)
def test_ctrl_c_at_any_moment_ends_in_a_sentence_and_leaves_nothing(
    cut_short, line, way, moments, loaded
):
    found = cut_short(line, way, moments, loaded=loaded)
    complete = 0
    for end in found["ends"]:
        assert end["code"] in (0, 2), end["said"]
        assert end["said"] == ("" if end["code"] == 0 else STOPPED), end["at"]
        if line[0] == "batch":
            assert_part_of_a_batch(end["files"], found)
        else:
            assert end["files"] in (found["before"], found["after"]), end["at"]
        complete += end["files"] == found["after"]
    assert complete < moments


def assert_part_of_a_batch(files, found):
    """Photos that are whole, a journal, and nothing else."""
    for name, content in files.items():
        if not name.endswith(".jsonl"):
            assert content == found["after"][name], name


@pytest.mark.parametrize(
    ("line", "moments", "loaded"),
    [(DEBLUR, 50, STAGES), (SIMULATE, 4, STAGES), (TILES, 4, WITH_ZARR)],
    ids=["deblur", "simulate", "zarr"],
)
def test_a_killed_run_leaves_each_output_old_or_new(cut_short, line, moments, loaded):
    found = cut_short(line, "kill", moments, loaded=loaded)
    for end in found["ends"]:
        assert end["code"] == -9
        named = {n: c for n, c in end["files"].items() if not n.startswith(PREFIX)}
        for name, content in named.items():
            assert content in (found["before"].get(name), found["after"].get(name)), name
        assert found["before"].keys() <= named.keys()


def test_a_killed_batch_goes_on_exactly_where_it_was(cut_short):
    found = cut_short(BATCH, "kill", 8, seed=3, again=True)
    photos = [name for name in found["after"] if name.endswith(".png")]
    for end in found["ends"]:
        assert end["second"] == [0, ""], end["at"]
        assert {n: end["finally"].get(n) for n in photos} == {n: found["after"][n] for n in photos}
        left = {name for name in end["finally"] if PREFIX not in name}
        assert left == found["after"].keys()

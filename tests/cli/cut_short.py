"""Runs the command again and again, each time cut short at another moment; a program of its own.

It takes lines of JSON on standard input, and answers each with one. What is loaded, also that
which the arguments name, is there for all runs, since each is a fork of this process; the moments
are counted in steps of the program, not in time.
"""

import importlib
import json
import os
import random
import shutil
import signal
import sys
import tempfile
from pathlib import Path

# What takes long to load, but is not ours.
OTHERS = ["numpy", "scipy.ndimage", "scipy.optimize", "scipy.signal", "scipy.fft", "scipy.linalg"]
OTHERS += [
    "scipy.interpolate",
    "scipy.sparse.linalg",
    "skimage.measure",
    "PIL.Image",
    "PIL.ImageOps",
]
OTHERS += ["PIL.PngImagePlugin", "PIL.JpegImagePlugin", "tifffile", "imagecodecs", "tempfile"]
OTHERS += ["secrets", "argparse"]
OURS = "napari_crfdeblur"
# Where outputs appear and what is beside them is taken away: half of the moments are there.
WRITING = tuple(f"{OURS}/io/{each}.py" for each in ("places", "outputs"))
APPEARING = ("appear", "_appear", "_set_aside", "drop", "__exit__")
BEGUN = 4  # steps until the command has begun
HEARD = 20  # steps until it hears Ctrl-C, so that the second one does no harm
MOST = 300  # times that Ctrl-C is pressed once more


class Steps:
    """Calls, and lines of our own, until something happens at one of them."""

    def __init__(self, at, happen):
        self.count, self._at, self._happen = 0, at, happen
        self.writing = []

    def __call__(self, frame, event, _argument):
        if event in ("call", "line"):
            self.count += 1
            code = frame.f_code
            if code.co_name in APPEARING and code.co_filename.endswith(WRITING):
                self.writing.append(self.count)
            if self.count == self._at:
                self._happen()
        return self if OURS in frame.f_code.co_filename else None


def once():
    signal.raise_signal(signal.SIGINT)


def again_and_again():
    left = [MOST]

    def more(_frame, _event, _argument):
        if left[0]:
            left[0] -= 1
            signal.raise_signal(signal.SIGINT)

    sys.setprofile(more)
    signal.raise_signal(signal.SIGINT)


def kill():
    os.kill(os.getpid(), signal.SIGKILL)


WAYS = {"once": once, "again": again_and_again, "kill": kill}


def run(line, folder, steps=None):
    """One run in a fork: how it ended, and what it said on standard error."""
    with tempfile.TemporaryFile() as error, tempfile.TemporaryFile() as counted:
        child = os.fork()
        if child == 0:
            os.chdir(folder)
            os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
            os.dup2(error.fileno(), 2)
            from napari_crfdeblur.cli import main

            sys.argv = ["crfdeblur", *line]
            sys.settrace(steps)
            code = main()
            sys.settrace(None)
            sys.setprofile(None)
            if steps:
                counted.write(json.dumps([steps.count, steps.writing]).encode())
                counted.flush()
            os._exit(code)
        _, status = os.waitpid(child, 0)
        error.seek(0)
        counted.seek(0)
        return (
            os.waitstatus_to_exitcode(status),
            error.read().decode(),
            json.loads(counted.read() or "null"),
        )


def everything(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes().hex()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def main():
    for name in OTHERS + sys.argv[1:]:
        importlib.import_module(name)
    for asked in sys.stdin:
        print(json.dumps(cut_short(json.loads(asked))), flush=True)


def cut_short(asked):
    """The whole run, and how those end that are cut short."""
    start, line = Path(asked["folder"]), asked["line"]
    folder = start.with_name("run")

    def fresh():
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(start, folder)

    fresh()
    code, error, (total, writing) = run(line, folder, Steps(0, None))
    after = everything(folder)
    draw, half = random.Random(asked["seed"]), asked["moments"] // 2
    first = HEARD if asked["way"] == "again" else BEGUN
    numbers = draw.sample(range(first, total + 1), half)
    numbers += draw.sample([number for number in writing if number >= first], half)
    ends = []
    for number in numbers:
        fresh()
        ended, said, _ = run(line, folder, Steps(number, WAYS[asked["way"]]))
        ends.append({"at": number, "code": ended, "said": said, "files": everything(folder)})
        if asked["again"]:
            ended, said, _ = run(line, folder)
            ends[-1] |= {"second": [ended, said], "finally": everything(folder)}
    whole = {"code": code, "said": error, "steps": total}
    return {"whole": whole, "before": everything(start), "after": after, "ends": ends}


if __name__ == "__main__":
    main()

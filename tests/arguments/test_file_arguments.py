"""Verbs that read and write files take names as paths or texts, and refuse all else in words."""

from typing import Any

import pytest
from outcomes import check_outcome, is_finite
from small_things import EDGE, ESTIMATE, KERNEL, PHOTO, QUICK
from wrong_values import WRONG

from napari_crfdeblur import io
from napari_crfdeblur.estimate import ResponseEstimate
from napari_crfdeblur.io.limits import Limits
from napari_crfdeblur.pipeline import Pixels, Record

RECORD = Record(Pixels("photo", "00ff", PHOTO.shape, "uint8"), QUICK)
# What is written in a file of which name, and read again.
PAIRS: dict[str, tuple[Any, Any, dict[str, Any], dict[str, Any]]] = {
    "a.png": (io.write_photo, io.read_photo, {"photo": PHOTO, "like": None}, {"limits": Limits()}),
    "b.tif": (io.write_photo, io.read_photo, {"photo": PHOTO / 255}, {"limits": Limits()}),
    "c.jpg": (io.write_photo, io.read_photo, {"photo": PHOTO}, {"limits": Limits()}),
    "d.npy": (io.write_psf, io.read_psf, {"psf": KERNEL}, {"limits": Limits()}),
    "e.tif": (io.write_psf, io.read_psf, {"psf": KERNEL}, {"limits": Limits()}),
    "f.png": (io.write_psf, io.read_psf, {"psf": KERNEL}, {"limits": Limits()}),
    "g.json": (io.write_edges, io.read_edges, {"edges": [EDGE]}, {"limits": Limits()}),
    "h.csv": (io.write_edges, io.read_edges, {"edges": [EDGE]}, {"limits": Limits()}),
    "i.json": (
        io.write_responses,
        io.read_responses,
        {"estimates": [ResponseEstimate(**ESTIMATE)]},
        {"limits": Limits()},
    ),
    "j.json": (io.write_record, io.read_record, {"record": RECORD}, {}),
}
each_pair = pytest.mark.parametrize("name", PAIRS)


@each_pair
def test_a_wrong_argument_of_a_file_is_refused_in_words_or_does_no_harm(tmp_path, name):
    write, read, content, how = PAIRS[name]
    given = {"path": tmp_path / name}
    for call, right in ((write, given | content), (read, given | how)):
        write(**given, **content)
        for argument in right:
            for wrong in WRONG:
                what = f"{call.__name__}({argument}={wrong!r:.80})"
                check_outcome(call, right | {argument: wrong}, what)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@each_pair
def test_the_name_of_a_file_can_be_a_text(tmp_path, name):
    write, read, content, _ = PAIRS[name]
    write(str(tmp_path / name), **content)
    if name.endswith(".csv"):  # which is written only
        assert (tmp_path / name).read_text().startswith("number,")
        return
    assert is_finite(read(str(tmp_path / name)))


@pytest.mark.parametrize("wrong", [None, 3, b"a.png", ["a.png"], object()])
def test_what_is_no_name_of_a_file_is_refused_before_all_else(wrong):
    for write, read, content, _ in PAIRS.values():
        for call, right in ((write, content), (read, {})):
            with pytest.raises(ValueError, match="expected the name of a file, got"):
                call(wrong, **right)

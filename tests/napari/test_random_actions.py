"""Whatever is done in a session, in any order and with any argument, it stays whole."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from napari.layers import Image as ImageLayer

from napari_crfdeblur import CrfDeblurError, DeblurOptions, Session
from napari_crfdeblur.deconvolution import Wiener
from napari_crfdeblur.edges import Edge, EdgeStatus, Line, Rectangle
from napari_crfdeblur.estimate import GivenResponse, RankMinimization
from napari_crfdeblur.io import record_from
from napari_crfdeblur.pipeline import PhotoStack
from napari_crfdeblur.psf import GivenPsf, RadonFit, XuJia
from napari_crfdeblur.response import SRGB, Gamma, Identity

ACTIONS = 20_000
CASES = 4
ROUND = 500  # actions until a new viewer is opened
DEAR = 0.08  # share of actions that compute or make layers
MANY = 9  # layers, after which some are removed: napari takes long with many
KERNEL = np.array([[0.0, 0.1, 0.0], [0.2, 0.4, 0.1], [0.0, 0.2, 0.0]])
KNOWN = DeblurOptions(response=GivenResponse(SRGB()), psf=GivenPsf(KERNEL), method=Wiener())
WHITES = (None, 1.0, 200, 255.0, 0, -3.0, float("nan"), float("inf"), True)
EXTENTS = (None, 3.0, 8, 0, -1.0, float("nan"), float("inf"), 1e9, "wide", True)
RESPONSES = (
    *(SRGB(), Identity(), Gamma(2.2), [Gamma(1.5)] * 3, (SRGB(), Gamma(2.0), Identity())),
    *((), (SRGB(), SRGB()), [SRGB()] * 4, None, "srgb", 2.2, [None, None, None]),
)
BLURS = (
    *(KERNEL, KERNEL[:1], np.ones((1, 1)), np.ones((3, 3, 3)), np.ones((5, 7))),
    *(np.zeros((3, 3)), -KERNEL, KERNEL * np.nan, np.ones(3), np.ones((2, 2)), np.ones((99, 99))),
    *(np.ones((0, 3)), None, "disk", np.ones((1, 1, 1, 1)), np.array([["a"]]), 3),
)
DRAWN = (
    Line((2.0, 3.0), (20.0, 18.0)),
    Line((1e9, 0.0), (1e9, 5.0)),
    Rectangle(((2.0, 2.0), (2.0, 12.0), (9.0, 12.0), (9.0, 2.0))),
    Edge((4.0, 1.0), (4.0, 20.0), 1, 3.0, 0.1, EdgeStatus.GOOD),
    Edge((40.0, 1.0), (90.0, 20.0), -1, 3.0, 0.1, EdgeStatus.GOOD),
    "an edge",
    None,
)
PLANES = (None, None, None, (), (0,), (1,), (99,), (-1,), (0, 0), ("a",))
NUMBERS = ((), (0,), (0, 1, 2), (-1,), (10**9,), ("a",), None, 0)
LAYER_KINDS = (np.uint8, np.uint16, np.float32, np.int32, bool)


class Player:
    """Does random things in a session.

    Parameters
    ----------
    seed : int
        What is drawn.
    """

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.begin()

    def begin(self) -> None:
        """Open a viewer with two photos."""
        self.viewer = ViewerModel()
        self.session = Session(self.viewer, self.viewer.add_image(self.pixels((24, 32))))
        self.viewer.add_image(self.pixels((24, 32, 3)), rgb=True)
        self.viewer.add_shapes([[[0, 0], [5, 5]]], shape_type="line")
        self.records: list[Any] = [self.session.record(), {}, None, {"format": 3}, "no.json"]

    def pick(self, members: Any) -> Any:
        """One of them."""
        return members[int(self.rng.integers(len(members)))]

    def pixels(self, shape: tuple[int, ...], kind: Any = np.uint8) -> np.ndarray:
        """Noise of a shape and kind."""
        return (self.rng.random(shape) * (1 if np.dtype(kind).kind in "fb" else 250)).astype(kind)

    def layer(self) -> Any:
        """A layer that there is, or what is none."""
        return self.pick([*self.viewer.layers, None, "photo"])

    def region(self) -> Any:
        """A region that fits, or one that does not."""
        photo = self.session.photo
        sides = (24, 32) if photo is None else photo.data.shape[: photo.ndim]
        spans: list[Any] = [(int(self.rng.integers(side)), side) for side in sides]
        wrong = (
            [(0, 999)] * len(sides),
            [(5, 5)] * len(sides),
            [(0, 4)],
            [],
            [(-3, 4)] * len(sides),
            [("a", "b")] * len(sides),
            [slice(None)] * len(sides),
            [(0,)] * len(sides),
            3,
        )
        return self.pick([None, None, spans, spans, self.pick(wrong)])

    def change_data(self) -> None:
        """The photo gets other pixels, often of another shape, as napari and others do it."""
        photo = self.session.photo
        if photo is None:
            return
        # With as many axes: napari itself fails where a layer gets others.
        flat, deep = [(24, 32), (24, 32), (12, 9), (30, 40), (5, 1)], [(3, 12, 20), (1, 30, 9)]
        sides = self.pick(flat if photo.ndim == len(flat[0]) else deep)
        colors = (3,) if photo.rgb else ()
        photo.data = self.pixels((*sides, *colors), self.pick(LAYER_KINDS))

    def remove_layer(self) -> None:
        """A layer is closed."""
        if len(self.viewer.layers):
            self.viewer.layers.remove(self.pick(list(self.viewer.layers)))

    def add_photo(self) -> None:
        """A photo is opened."""
        if len(self.viewer.layers) < MANY:
            self.viewer.add_image(self.pixels(self.pick([(24, 32), (2, 16, 20), (1, 5)])))

    def keep_record(self) -> None:
        """What was done is noted."""
        self.records[0] = self.session.record()

    def cheap(self) -> dict[str, Callable[[], Any]]:
        """What takes a moment."""
        s, pick = self.session, self.pick
        return {
            "undo_edges": s.undo_edges,
            "redo_edges": s.redo_edges,
            "select": lambda: setattr(s, "selected", pick([None, 0, 1, -1, 10**9])),
            "white": lambda: setattr(s, "white", pick(WHITES)),
            "photo": lambda: setattr(s, "photo", self.layer()),
            "set_response": lambda: s.set_response(pick(RESPONSES)),
            "remove_edges": lambda: s.remove_edges(pick(NUMBERS)),
            "flip": s.flip,
            "record": self.keep_record,
            "estimate_response": lambda: s.estimate_response(
                pick([None, RankMinimization()]),
                others=pick([(), (), (self.layer(),), ("no.png",)]),
            ),
            "load_psf": lambda: s.load_psf("missing.npy"),
            "load_edges": lambda: s.load_edges("missing.json"),
            "load_response": lambda: s.load_response("missing.json"),
            "export": lambda: s.export(pick(["record", "PSF", "edges", "all"]), "a/b/c.bad"),
            "restore_into": lambda: s.restore_into("missing/there.tif"),
        }

    def dear(self) -> dict[str, Callable[[], Any]]:
        """What computes, or makes layers."""
        s, pick = self.session, self.pick
        return {
            "data": self.change_data,
            "data again": self.change_data,
            "remove": self.remove_layer,
            "add": self.add_photo,
            "script": s.script,
            "set_edges": lambda: s.set_edges(
                [pick(DRAWN) for _ in range(int(self.rng.integers(3)))],
                pick(EXTENTS),
                plane=pick(PLANES),
            ),
            "detect_edges": lambda: s.detect_edges(
                pick(EXTENTS), add=bool(self.rng.integers(2)), plane=pick(PLANES)
            ),
            "set_psf": lambda: s.set_psf(pick(BLURS)),
            "use_psf_of": lambda: s.use_psf_of(self.layer()),
            "estimate_psf": lambda: s.estimate_psf(
                pick([RadonFit(size=3), XuJia(size=99), "best"]),
                region=self.region(),
                regions=pick([None, None, 0, 99, "two"]),
            ),
            "linearize": lambda: s.linearize(region=self.region()),
            "deconvolve": lambda: s.deconvolve(pick([Wiener(), Wiener(), "sharp"])),
            "reapply": s.reapply,
            "restore": lambda: s.restore(Wiener(), region=self.region()),
            "compare_with": lambda: s.compare_with(
                pick([None, SRGB(), 2.2]), Wiener(), region=self.region()
            ),
            "preview": lambda: s.preview(Wiener()),
            "deblur": lambda: s.deblur(pick([KNOWN, "all"])),
            "restore_layers": lambda: s.restore_layers([self.layer()], Wiener()),
            "repeat": lambda: s.repeat(pick(self.records)),
        }


def known(session: Session) -> tuple[Any, ...]:
    """All that a verb that was refused must leave as it was."""
    state = session.state
    layers = [
        (layer, id(layer.data) if isinstance(layer, ImageLayer) else None, layer.visible)
        for layer in session.viewer.layers
    ]
    return (
        session.photo,
        [id(getattr(state, field.name)) for field in fields(state)],
        layers,
        session.white,
        session.selected,
    )


def check(session: Session) -> None:
    """What holds of every session."""
    state, layers, photo = session.state, session.viewer.layers, session.photo
    shown = [state.restored, *(own.layer for own in (state.linear, state.sharp) if own)]
    assert all(layer is None or layer in layers for layer in shown)
    if session.selected is not None:
        assert state.edges is not None
        assert session.selected < len(state.edges.edges)
    if photo is None:
        return
    assert isinstance(photo, ImageLayer)
    sides = photo.data.shape[: photo.ndim]
    if state.edges is not None:
        assert len(state.edges.plane) == len(sides)
        assert all(a.stop <= n for a, n in zip(state.edges.plane, sides, strict=True))
    if state.psf is not None:
        assert state.psf.psf.ndim <= len(sides)
    stack = PhotoStack(np.empty(photo.data.shape, np.uint8), bool(photo.rgb))
    if state.record is not None:
        state.record.check_fits(stack)


@pytest.mark.parametrize("seed", range(CASES))
def test_a_session_stays_whole_whatever_is_done(seed: int) -> None:
    player, done = Player(seed), dict.fromkeys((True, False), 0)
    for number in range(ACTIONS // CASES):
        if number % ROUND == ROUND - 1:
            player.begin()
        while len(player.viewer.layers) > MANY:
            player.remove_layer()
        members = player.dear() if player.rng.random() < DEAR else player.cheap()
        name = player.pick(list(members))
        before, refused = known(player.session), None
        try:
            members[name]()
        except (CrfDeblurError, ValueError) as error:
            refused = str(error)
        if refused is None:
            check(player.session)
        else:
            assert refused, name
            assert known(player.session) == before, (number, name)
        done[refused is None] += 1
    assert min(done.values()) > ACTIONS // CASES // 10
    if player.session.photo is not None:
        with suppress(CrfDeblurError):  # a kind of number that asks for a white level
            record_from(player.session.record(), "the session")

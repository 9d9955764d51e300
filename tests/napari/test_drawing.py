"""What is drawn on the canvas and what the session knows are always alike."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from napari.components import ViewerModel
from napari.layers import Shapes
from napari.utils.interactions import (
    mouse_move_callbacks,
    mouse_press_callbacks,
    mouse_release_callbacks,
)
from scipy.ndimage import gaussian_filter

from napari_crfdeblur import CrfDeblurError, Session
from napari_crfdeblur._napari.session.edges import detecting_edges
from napari_crfdeblur._napari.session.step import Message, apply
from napari_crfdeblur._napari.shapes import points_in
from napari_crfdeblur.edges import EdgeStatus, Line
from napari_crfdeblur.progress import drain

UPRIGHT = ((20.0, 70.0), (100.0, 70.0))  # along the edge of the bright half
LEVEL = ((80.0, 12.0), (80.0, 55.0))


def blocks() -> np.ndarray:
    """Three areas that meet in an upright and a level edge, blurred; not square."""
    photo = np.full((120, 160), 0.25)
    photo[80:] = 0.5
    photo[:, 70:] = 0.8
    noise = np.random.default_rng(4).normal(0, 0.002, photo.shape)
    return (gaussian_filter(photo, 2.0) + noise).astype(np.float32)


@pytest.fixture
def session(viewer: ViewerModel) -> Session:
    return Session(viewer, viewer.add_image(blocks(), name="blocks"))


@pytest.fixture
def said(session: Session) -> list[str]:
    """What the user was told."""
    texts: list[str] = []

    def keep(message: Message) -> None:
        texts.append(message.text)

    session.said.connect(keep)
    return texts


@dataclass
class Mouse:
    """A mouse on a layer, as napari's canvas hands its events on."""

    layer: Shapes
    position: tuple[float, ...] = ()
    type: str = ""
    modifiers: list[str] = field(default_factory=list)
    button: int = 1
    handled: bool = False
    is_dragging: bool = True
    dims_displayed: tuple[int, ...] = (0, 1)
    view_direction: Any = None

    @property
    def pos(self) -> np.ndarray:
        return np.array(self.position[-2:])

    def press(self, *position: float) -> None:
        self.position, self.type = position, "mouse_press"
        self.dims_displayed = (len(position) - 2, len(position) - 1)
        mouse_press_callbacks(self.layer, self)

    def move(self, *position: float) -> None:
        self.position, self.type = position, "mouse_move"
        mouse_move_callbacks(self.layer, self)

    def release(self) -> None:
        self.type = "mouse_release"
        mouse_release_callbacks(self.layer, self)

    def drag(self, start: tuple[float, ...], end: tuple[float, ...]) -> None:
        middle = tuple((a + b) / 2 for a, b in zip(start, end, strict=True))
        self.press(*start)
        self.move(*middle)
        self.move(*end)
        self.release()


def ends(session: Session) -> np.ndarray:
    """End points of the edges of the session, shape (n, 2, 2)."""
    edges = session.state.edges
    return np.array([[e.start, e.end] for e in edges.edges]) if edges else np.empty((0, 2, 2))


def drawn_at(session: Session) -> np.ndarray:
    """End points of the lines on the canvas, in pixels of the photo."""
    layer, photo = session.drawing.layer, session.photo
    return np.array([points_in(layer, line, photo) for line in layer.data])


def test_a_line_drawn_with_the_mouse_becomes_an_edge(session: Session) -> None:
    Mouse(session.draw_edges()).drag((22, 72.5), (98, 71.0))
    edges = session.state.edges
    assert len(edges.edges) == 1
    assert edges.edges[0].good
    np.testing.assert_allclose(ends(session)[0][:, 1], 69.5, atol=0.2)
    np.testing.assert_allclose(drawn_at(session), ends(session), atol=1e-5)
    assert session.drawing.layer.features["group"].tolist() == [0]
    assert session.selected == 0, "its profile is shown"


def test_a_rectangle_drawn_with_the_mouse_becomes_an_edge(session: Session) -> None:
    Mouse(session.draw_edges("rectangle")).drag((20, 58), (70, 82))
    assert [edge.good for edge in session.state.edges.edges] == [True]
    assert session.drawing.layer.shape_type == ["line"]


def test_lines_are_drawn_one_after_the_other(session: Session) -> None:
    mouse = Mouse(session.draw_edges())
    mouse.drag(*UPRIGHT)
    mouse.drag(*LEVEL)
    assert len(session.state.edges.groups) == 2
    colors = session.drawing.layer.edge_color
    assert not np.allclose(colors[0], colors[1])


def test_an_edge_that_is_moved_keeps_its_number(session: Session) -> None:
    mouse = Mouse(session.draw_edges())
    mouse.drag(*UPRIGHT)
    mouse.drag(*LEVEL)
    mouse.layer.mode = "select"
    before = ends(session)
    mouse.drag((60, 69.5), (66, 69.5))
    moved = ends(session)
    np.testing.assert_array_equal(moved[1], before[1])
    assert abs(moved[0] - before[0]).max() > 1
    assert session.selected == 0
    np.testing.assert_allclose(drawn_at(session), moved, atol=1e-5)


def test_delete_takes_edges_out_and_undo_brings_them_back(session: Session) -> None:
    session.set_edges([_line(UPRIGHT), _line(LEVEL)])
    before = session.state.edges
    layer = session.drawing.layer
    layer.selected_data = {0}
    layer.remove_selected()
    assert len(session.state.edges.edges) == len(layer.data) == 1
    session.undo_edges()
    assert session.state.edges is before
    assert len(layer.data) == 2
    session.redo_edges()
    assert len(layer.data) == 1


def test_all_edges_can_be_deleted_and_others_drawn(session: Session) -> None:
    session.set_edges([_line(UPRIGHT)])
    layer = session.drawing.layer
    layer.selected_data = {0}
    layer.remove_selected()
    assert session.state.edges.edges == ()
    assert len(layer.data) == 0
    Mouse(session.draw_edges()).drag(*LEVEL)
    assert len(session.state.edges.edges) == 1


def test_what_is_found_while_the_mouse_draws_is_kept_with_what_it_draws(session: Session) -> None:
    session.set_edges([_line(UPRIGHT)])
    mouse = Mouse(session.draw_edges())
    mouse.press(*LEVEL[0])
    mouse.move(80, 30)
    found = session.set_edges([*session.state.edges.edges, _line(((20.0, 71.0), (60.0, 71.0)))])
    mouse.move(*LEVEL[1])
    mouse.release()
    assert session.state.edges.edges[:2] == found.edges
    assert len(session.state.edges.edges) == 3
    np.testing.assert_allclose(drawn_at(session), ends(session), atol=1e-5)


def test_a_line_drawn_while_edges_are_sought_is_kept(session: Session) -> None:
    step = detecting_edges(session, 12.0)
    found = drain(step.job)
    Mouse(session.draw_edges()).drag(*LEVEL)
    drawn = session.state.edges.edges
    apply(step.finish(found))
    assert set(session.state.edges.edges) == {*found.edges, *drawn}
    assert len(session.drawing.layer.data) == len(session.state.edges.edges)


def test_edges_found_while_a_drawn_line_is_refined_are_kept(session: Session) -> None:
    late: list[Any] = []
    session.start = late.append
    Mouse(session.draw_edges()).drag(*LEVEL)
    found = session.detect_edges(12.0)
    assert session.drawing.layer.nshapes == len(found.edges) + 1, "the line waits on the canvas"
    session.start = session.do
    session.do(late[0])
    assert set(found.edges) < set(session.state.edges.edges)
    assert len(session.state.edges.edges) == len(found.edges) + 1
    np.testing.assert_allclose(drawn_at(session), ends(session), atol=1e-5)


def test_the_next_line_takes_one_along_that_is_still_refined(session: Session) -> None:
    late: list[Any] = []
    session.start = late.append
    mouse = Mouse(session.draw_edges())
    mouse.drag(*UPRIGHT)
    mouse.drag(*LEVEL)
    session.do(late[-1])  # in the place of the first, as in the widgets' thread
    assert len(session.state.edges.edges) == 2


def test_an_edge_refined_while_the_next_is_drawn_is_not_there_twice(session: Session) -> None:
    late: list[Any] = []
    session.start = late.append
    mouse = Mouse(session.draw_edges())
    mouse.drag(*UPRIGHT)
    mouse.press(*LEVEL[0])
    session.do(late[0])
    mouse.move(*LEVEL[1])
    mouse.release()
    session.do(late[1])
    assert len(session.state.edges.edges) == 2
    assert session.drawing.layer.nshapes == 2


@pytest.mark.parametrize("kind", ["polygon", "ellipse"])
def test_other_shapes_are_refused_in_a_sentence(
    session: Session, said: list[str], kind: str
) -> None:
    session.set_edges([_line(UPRIGHT)])
    layer, before = session.drawing.layer, session.state.edges
    corners = np.array([[20, 20], [20, 40], [50, 40], [50, 20]], dtype=float)
    layer.add([corners], shape_type=kind)
    assert "lines or rectangles" in said[-1]
    assert session.state.edges is before
    assert layer.shape_type == ["line"], "it does not stay in the way"


def test_a_click_is_no_edge(session: Session, said: list[str]) -> None:
    mouse = Mouse(session.draw_edges())
    mouse.press(50, 50)
    mouse.release()
    assert session.state.edges is None
    assert mouse.layer.nshapes == 0
    assert "press at one end" in said[-1]


def test_an_edge_outside_of_the_photo_is_rejected_with_a_reason(session: Session) -> None:
    Mouse(session.draw_edges()).drag((20, 190), (100, 190))
    (edge,) = session.state.edges.edges
    assert edge.status is EdgeStatus.OUTSIDE


def test_several_edges_stay_selected_on_the_canvas(session: Session) -> None:
    session.set_edges([_line(UPRIGHT), _line(LEVEL)])
    layer = session.drawing.layer
    layer.selected_data = {0, 1}
    assert set(layer.selected_data) == {0, 1}
    assert session.drawing.chosen == (0, 1)
    session.selected = None
    assert not layer.selected_data


def test_edges_follow_a_scaled_and_turned_photo(viewer: ViewerModel) -> None:
    photo = viewer.add_image(
        blocks(), scale=(0.5, 2.0), translate=(30, -7), rotate=20, shear=[0.3], name="placed"
    )
    session = Session(viewer, photo)
    mouse = Mouse(session.draw_edges())
    mouse.drag(photo.data_to_world(UPRIGHT[0]), photo.data_to_world(UPRIGHT[1]))
    assert session.state.edges.edges[0].good
    np.testing.assert_allclose(drawn_at(session), ends(session), atol=1e-4)


def test_shapes_in_other_coordinates_are_used_where_they_lie(session: Session) -> None:
    data = [(np.array(UPRIGHT) - (5, 3)) / (2.0, 0.5)]
    shapes = session.viewer.add_shapes(
        data, shape_type="line", scale=(2.0, 0.5), translate=(5, 3), name="mine"
    )
    found = session.use_edges_of(shapes)
    assert found.edges[0].good
    np.testing.assert_allclose(ends(session)[0][:, 1], 69.5, atol=0.2)


def test_layers_without_lines_cannot_be_used(session: Session) -> None:
    viewer = session.viewer
    with pytest.raises(CrfDeblurError, match="Points layer: choose a Shapes layer"):
        session.use_edges_of(viewer.add_points([[1, 2]]))
    with pytest.raises(CrfDeblurError, match="is empty"):
        session.use_edges_of(viewer.add_shapes())


def test_a_layer_whose_photo_was_closed_says_so(session: Session, said: list[str]) -> None:
    session.set_edges([_line(UPRIGHT)])
    layer = session.drawing.layer
    session.viewer.layers.remove(session.photo)
    layer.add_lines(np.array(LEVEL))
    assert "was closed" in said[-1]


def test_without_their_layer_there_are_no_edges_until_undo(
    session: Session, said: list[str]
) -> None:
    before = session.set_edges([_line(UPRIGHT)])
    session.viewer.layers.remove(session.drawing.layer)
    assert session.state.edges is None
    assert session.drawing.layer is None
    assert "undo" in said[-1]
    session.undo_edges()
    assert session.state.edges is before
    assert session.drawing.layer.nshapes == 1
    session.repeat(session.record())


def test_drawing_on_the_edges_of_another_photo_goes_on_with_that_photo(session: Session) -> None:
    first = session.photo
    session.set_edges([_line(UPRIGHT)])
    layer = session.drawing.layer
    session.photo = session.viewer.add_image(blocks()[:, ::-1], name="mirrored")
    layer.add_lines(np.array(LEVEL))
    assert session.photo is first
    assert len(session.state.edges.edges) == 2


def test_edges_are_not_drawn_in_3d(session: Session) -> None:
    session.viewer.dims.ndisplay = 3
    with pytest.raises(CrfDeblurError, match="leave the 3D view"):
        session.draw_edges()
    with pytest.raises(ValueError, match="expected line or rectangle, got ellipse"):
        session.draw_edges("ellipse")


class TestStack:
    @pytest.fixture
    def session(self, viewer: ViewerModel) -> Session:
        photo = viewer.add_image(np.stack([blocks()] * 3), name="stack")
        viewer.dims.set_point(0, 1)
        return Session(viewer, photo)

    def test_edges_lie_on_the_slice_they_are_drawn_on(self, session: Session) -> None:
        Mouse(session.draw_edges()).drag((1, *UPRIGHT[0]), (1, *UPRIGHT[1]))
        assert session.state.edges.plane[0] == slice(1, 2)
        assert session.drawing.layer.data[0][:, 0].tolist() == [1, 1]

    def test_edges_on_two_slices_are_refused(self, session: Session, said: list[str]) -> None:
        mouse = Mouse(session.draw_edges())
        mouse.drag((1, *UPRIGHT[0]), (1, *UPRIGHT[1]))
        before = session.state.edges
        session.viewer.dims.set_point(0, 2)
        mouse.drag((2, *LEVEL[0]), (2, *LEVEL[1]))
        assert "one slice of the stack" in said[-1]
        assert session.state.edges is before
        assert mouse.layer.nshapes == 1

    def test_edges_of_another_slice_are_not_added(self, session: Session) -> None:
        session.set_edges([_line(UPRIGHT)])
        session.viewer.dims.set_point(0, 2)
        with pytest.raises(CrfDeblurError, match="one slice of the stack"):
            session.detect_edges(12.0, add=True)

    def test_edges_beyond_the_stack_are_refused(self, session: Session, said: list[str]) -> None:
        layer = session.draw_edges()
        layer.add_lines(np.array([(5, *LEVEL[0]), (5, *LEVEL[1])]))
        assert "has no slice there" in said[-1]
        assert layer.nshapes == 0

    def test_flat_shapes_are_used_on_the_slice_that_is_shown(self, session: Session) -> None:
        shapes = session.viewer.add_shapes(
            [np.array(UPRIGHT)], shape_type="line", name="flat", ndim=2
        )
        session.viewer.dims.set_point(0, 2)
        assert session.use_edges_of(shapes).plane[0] == slice(2, 3)


def _line(points: tuple[tuple[float, float], tuple[float, float]]) -> Line:
    return Line(*points)

"""How much of a method there is, in the window."""

from pytestqt.qtbot import QtBot

from napari_crfdeblur._napari.docks.strength import DeconvolutionForm
from napari_crfdeblur.deconvolution import Strengthened, Wiener
from napari_crfdeblur.pipeline import DEFAULT_METHOD


def test_at_1_it_is_the_chosen_method_itself(qtbot: QtBot) -> None:  # noqa: ARG001 - widgets need Qt
    wiener = Wiener()
    form = DeconvolutionForm({"automatic": None, "Wiener": wiener}, "Wiener")
    assert form.method is wiener
    form.chosen = "automatic"
    assert form.method is None


def test_else_it_is_more_or_less_of_it_and_is_told(qtbot: QtBot) -> None:  # noqa: ARG001 - widgets need Qt
    form = DeconvolutionForm({"automatic": None, "Wiener": Wiener()}, "Wiener")
    told = []
    form.edited.connect(lambda: told.append(form.method))
    form.strength.value = 0.5
    assert told == [Strengthened(Wiener(), 0.5)]
    form.chosen = "automatic"
    assert form.method == Strengthened(DEFAULT_METHOD, 0.5)

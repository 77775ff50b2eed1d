"""What every public result shows of itself: one line, its report, a picture, a page of a notebook, JSON, a table."""

import inspect
import json
import pickle
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest
from helpers.places import PROBLEMS
from matplotlib.axes import Axes

import tmsopt
from tmsopt.documents import MODULE_BY_CLASS, picture_of
from tmsopt.models import from_coefficients

mpl.use("Agg")
TITLE = "<script>alert(1)</script> & a title of more than one hundred characters, so that no line of it has room for the whole"
VOID = {"img", "br", "meta"}


@cache
def design():
    return tmsopt.solve(replace(tmsopt.load(PROBLEMS / "ep4.toml"), title=TITLE))


@cache
def plane():
    """s⁴ + 4s³ + 6s² + b s + c: stable, EP4 at b = 4, c = 1."""
    return tmsopt.Problem(from_coefficients([1, 4, 6, "b", "c"]), free={"b": (2.0, 6.0), "c": (-1.0, 3.0)}, title=TITLE)


def tailed():
    """The quadratic coefficient free too: the swallowtail around that EP4."""
    box = {"a": (5.5, 6.5), "b": (3.0, 5.0), "c": (0.5, 1.5)}
    return tmsopt.Problem(from_coefficients([1, 4, "a", "b", "c"]), free=box, title=TITLE)


@cache
def traced():
    return tmsopt.trace(plane(), "EP2", starts=4)


@cache
def explained():
    return tmsopt.explain(design(), resolve=False)


@cache
def charted():
    return tmsopt.chart(plane(), points=(9, 7))


@cache
def studied():
    return tmsopt.run_study(tmsopt.over_grid(design().problem, {"mu": [0.1, 0.2]}, starts=4), workers=1)


def front():
    """Of s² + cs + 1: the abscissa is −c/2."""
    problem = tmsopt.Problem(
        from_coefficients([1, "c", 1]), free={"c": (0.5, 1.5)}, pareto=("abscissa", "c"), title=TITLE
    )
    return tmsopt.pareto(problem, points=2)


def every():
    return tmsopt.solve_all(replace(tmsopt.load(PROBLEMS / "ep4_matching.toml"), title=TITLE), seconds=0, starts=8)


def dimer():
    return replace(tmsopt.load(PROBLEMS / "loss_only_dimer.toml"), title=TITLE)


def unstable():
    """Not optimal, without a stable design."""
    problem = tmsopt.Problem(
        plane().model, free={"b": (-3.0, -1.0)}, fixed={"c": 1.0}, minimize="abscissa", title=TITLE
    )
    return tmsopt.solve(problem, throw=False)


RESULTS = {
    "Solution": design,
    "Solution, not stable": unstable,
    "Front": front,
    "Trace": traced,
    "Branch": lambda: traced().branches[0],
    "Chart": charted,
    "Speeds": lambda: tmsopt.speeds(design()),
    "Growth": lambda: tmsopt.growth(design()),
    "Simulation": lambda: tmsopt.simulate(design(), lean=5, points=21),
    "Comparison": lambda: tmsopt.compare(design()),
    "Results": studied,
    "Proof": lambda: tmsopt.prove(design()),
    "Every": every,
    "Explanation": explained,
    "Optimality": lambda: explained().optimality,
    "Robustness": lambda: tmsopt.robustness(design()),
    "Nearest": lambda: tmsopt.nearest(design(), "weave"),
    "Diagnosis": lambda: tmsopt.diagnose(design())[0],
    "Eigenvalues": lambda: tmsopt.eigenvalues(design()),
    "Loop": lambda: tmsopt.encircle(dimer(), starts=0),
    "Sheets": lambda: tmsopt.sheets(dimer(), grid=(7, 5)),
    "Domain": lambda: charted().domain,
    "Swallowtail": lambda: tmsopt.swallowtail(tailed(), rows=4, across=3, starts=4),
    "Ledger": lambda: tmsopt.verify(only=["lscf-*"]),
    "Description": lambda: tmsopt.describe(plane()),
}
TITLED = "Eigenvalues Solution Front Trace Loop Sheets Chart Speeds Simulation Comparison Results Proof Swallowtail Every Robustness Description"
made = cache(lambda name: RESULTS[name]())
each = pytest.mark.parametrize("name", RESULTS)


class Page(HTMLParser):
    """Tags of a fragment, and whether each is closed."""

    def __init__(self, text):
        super().__init__()
        self.open = []
        self.tags = []
        self.said = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        for name, value in attrs:
            assert name not in ("href", "onclick", "onload")
            assert name != "src" or (value or "").startswith("data:image/")
            assert name != "style" or not ("background" in (value or "") and "#" in (value or ""))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.said.append(data)


@pytest.mark.slow
def test_every_result_is_here():
    """Every public class that shows itself, and no writer without a class; an Explorer is a page already."""
    shown = {n for n in tmsopt.__all__ if inspect.isclass(c := getattr(tmsopt, n)) and hasattr(c, "_repr_html_")}
    shown -= {"Explorer"}
    assert shown == set(MODULE_BY_CLASS) == {type(made(name)).__name__ for name in RESULTS}


@each
def test_its_repr_is_one_short_line(name):
    line = repr(made(name))
    assert len(line.splitlines()) == 1
    assert len(line) <= 100
    assert line.startswith(f"{type(made(name)).__name__}(")
    assert line.endswith(")")


@each
def test_its_text_is_its_report(name):
    result = made(name)
    assert str(result) == result.report() != repr(result)
    assert len(result.report(full=True).splitlines()) >= len(str(result).splitlines()) > 0


@each
@pytest.mark.slow
def test_it_is_drawn_into_axes(name):
    result = made(name)
    if name in ("Branch", "Description", "Eigenvalues"):
        with pytest.raises(tmsopt.InputError, match=f"no picture of a {name} alone"):
            result.plot()
        return
    draw = getattr(tmsopt.plots, picture_of(result), None)
    if draw is None or "ax" in list(inspect.signature(draw).parameters)[:1]:
        pytest.skip("nothing draws it yet")
    assert isinstance(result.plot(), Axes)
    plt.close("all")
    assert "img" in Page(result._repr_html_()).tags
    assert plt.get_fignums() == []
    with pytest.raises(tmsopt.InputError, match=r"ax: found .*accepted: Axes"):
        result.plot(3)


@pytest.mark.slow
@each
def test_its_page_is_whole_and_escaped(name):
    page = Page(made(name)._repr_html_())
    assert page.open == []
    assert "script" not in page.tags
    assert {"div", "strong"} <= set(page.tags)
    assert TITLE in page.said or type(made(name)).__name__ not in TITLED.split()
    last = next(word for word in reversed(str(made(name)).split()) if word.isalnum())
    assert any(last in text for text in page.said)


def test_new_figures_are_shown_by_pyplot(monkeypatch):
    """In a notebook, and by plt.show(); those of the page are not, nor those of the user again."""

    def draws(data, ax=None):
        ax = ax or tmsopt.plots.new_figure(3, 2).subplots()
        ax.plot([0, 1], [0, 1])
        return ax

    monkeypatch.setattr(tmsopt.plots, picture_of(design()), draws, raising=False)
    before = plt.get_fignums()
    ax = design().plot()
    assert plt.gcf() is ax.get_figure()
    assert len(plt.get_fignums()) == len(before) + 1
    assert design().plot(ax) is ax
    assert "img" in Page(design()._repr_html_()).tags
    assert len(plt.get_fignums()) == len(before) + 1
    plt.close(plt.gcf())


@pytest.mark.slow
def test_the_page_of_a_design_has_badges_and_parameters():
    said = Page(design()._repr_html_()).said
    assert {"optimal", "proved", "stable", "EP4"} <= set(said)
    for parameter in tmsopt.models.tms.sets[0].parameters:
        assert {parameter.name, parameter.meaning} <= set(said)
    assert "not stable" in Page(made("Solution, not stable")._repr_html_()).said


@pytest.mark.slow
def test_a_picture_that_fails_does_not_break_the_page(monkeypatch):
    def fails(*_, **__):
        raise RuntimeError

    whole = str(design())
    monkeypatch.setattr(tmsopt.plots, picture_of(design()), fails, raising=False)
    assert "img" not in Page(design()._repr_html_()).tags
    assert str(design()) == whole


@each
def test_its_json_comes_back(name):
    data = made(name).to_json()
    assert json.loads(json.dumps(data, allow_nan=False)) == data


@each
def test_it_is_pickled_with_all_that_it_shows(name):
    result = made(name)
    again = pickle.loads(pickle.dumps(result))
    assert (repr(again), str(again)) == (repr(result), str(result))


@pytest.mark.parametrize("name", [n for n in RESULTS if hasattr(getattr(tmsopt, n.split(",")[0]), "to_frame")])
def test_its_table_has_a_row_for_each_record(name):
    pytest.importorskip("pandas")
    result, frame = made(name), made(name).to_frame()
    assert len(frame) == len(result.rows if name == "Results" else list(result.records()))
    assert all(isinstance(column, str) for column in frame.columns)


def test_tables_hold_the_numbers():
    pytest.importorskip("pandas")
    assert studied().to_frame()["varied.mu"].tolist() == [0.1, 0.2]
    assert studied().to_frame()["abscissa"].tolist() == [row.abscissa for row in studied().rows]
    assert made("Trace").to_frame()["branch"].nunique() == len(traced().branches)
    assert made("Front").to_frame()["stable"].tolist() == [p.stable for p in made("Front").points]


def test_grids_are_datasets():
    pytest.importorskip("xarray")
    chart = charted().to_xarray()
    assert dict(chart.sizes) == {"c": 7, "b": 9}
    assert chart["abscissa"].values.tolist() == charted().abscissa.tolist()
    assert studied().to_xarray()["abscissa"].values.tolist() == [row.abscissa for row in studied().rows]
    one = tmsopt.Study(design().problem, {"mu": [0.1, 0.1]})
    with pytest.raises(tmsopt.InputError, match="use to_frame"):
        replace(studied(), study=one, rows=studied().rows[:1] * 2).to_xarray()


def test_what_is_missing_is_named(monkeypatch):
    for module in ("pandas", "xarray"):
        monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(tmsopt.InputError, match=r'pandas is not installed; pip install "tmsopt\[data\]"'):
        traced().to_frame()
    with pytest.raises(tmsopt.InputError, match=r'xarray is not installed; pip install "tmsopt\[data\]"'):
        charted().to_xarray()

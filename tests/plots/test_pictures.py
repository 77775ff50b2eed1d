"""What pictures of results show, read from their Axes, against published numbers and closed forms."""

import math
from dataclasses import replace
from importlib import import_module

import matplotlib.colors as mcolors
import numpy as np
import pytest
from click.testing import CliRunner
from helpers.oracles import is_stable_60, polynomial_60
from helpers.places import PROBLEMS
from matplotlib.collections import LineCollection, QuadMesh

import tmsopt
from tmsopt import plots
from tmsopt.cli import command_group as main

WEAVE, CAPSIZE = 4.29238253634111, 6.02426201538837  # Meijaard et al. (2007), section 6
MODES_AT_5 = {
    "capsize": -0.32286642900409,
    "weave": -0.77534188219585 + 4.46486771378823j,
    "castering": -14.07838969279820,
}
"""Their Table 2: roots of the benchmark bicycle at 5 m/s, in 1/s, by the names they give them."""

ROBOT = """
title = "A small robot"
model = "tms"
[parameters]
w = "40 cm"
v = { min = "2 km/h", max = "20 km/h" }
m_B = "8 kg"
m_H = "800 g"
x_B = "50 cm"
z_B = "-16 cm"
x_H = "41 cm"
z_H = "-8 cm"
lambda_s = { min = "1 deg", max = "60 deg" }
"""
RATE = math.sqrt(9.81 / 0.4)  # 1/s per √(g/w)


def ax_of():
    return plots.new_figure(5, 4).subplots()


def vertical(ax):
    """Places of the vertical lines through the whole plot, by the beginning of their label."""
    lines = (line for line in ax.lines if len(x := line.get_xdata()) == 2 and x[0] == x[1])
    return {line.get_label().split()[0]: line.get_xdata()[0] for line in lines}


def words(ax):
    return [t.get_text() for t in ax.texts]


@pytest.fixture(scope="module")
def whipple():
    """The benchmark bicycle at 5 m/s."""
    problem = tmsopt.load("problems/whipple_benchmark.toml")
    return tmsopt.solve(replace(problem, fixed={**problem.fixed, "v": 5.0}))


@pytest.fixture(scope="module")
def robot_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("robot") / "robot.toml"
    path.write_text(ROBOT + '[objective]\nminimize = "abscissa"\n[constraints]\narm = "abs(u_H) >= 0.02"\n')
    return path


@pytest.fixture(scope="module")
def robot(robot_file):
    return tmsopt.solve(robot_file)


# Growth


def test_published_speeds_are_marked_and_in_sight(whipple):
    ax = plots.draw_growth(whipple, ax_of())
    marked = vertical(ax)
    assert marked["weave"] == pytest.approx(WEAVE, abs=1e-13)
    assert marked["capsize"] == pytest.approx(CAPSIZE, abs=1e-13)
    assert marked["design"] == 5.0
    assert ax.get_xlim()[1] > CAPSIZE
    legend = [t.get_text() for t in ax.get_legend().get_texts()]
    assert {"weave at 4.292 m/s", "capsize at 6.024 m/s", "design at 5 m/s"} <= set(legend)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$v$ in m/s", "growth rate in 1/s")


def test_modes_have_the_names_of_the_published_table(whipple):
    data = tmsopt.growth(whipple)
    (k,) = np.flatnonzero(data.values == 5.0)
    here = {m.name: m.roots[m.values == 5.0][0] for m in data.modes if 5.0 in m.values}
    assert set(here) == set(MODES_AT_5)
    for name, root in MODES_AT_5.items():
        assert here[name] == pytest.approx(root, abs=1e-12)  # printed to 14 decimals
    assert len(data.roots[k]) == 4


@pytest.mark.parametrize("part", ["growth", "frequencies"])
def test_a_name_stands_at_its_own_curve(whipple, part):
    """The leader of a name begins at a point of the curve; the frequency of a real root is none."""
    data = tmsopt.growth(whipple)
    ax = (plots.draw_growth if part == "growth" else plots.draw_frequencies)(data, ax_of())
    curves = import_module("tmsopt.plots.growth").draw_curves
    found = curves(ax_of(), data, "real" if part == "growth" else "imag")
    assert sorted(words(ax)) == sorted(n.text for n in found)
    assert {n.text for n in found} == ({"weave", "capsize", "castering"} if part == "growth" else {"weave"})
    for name in found:
        a = tmsopt.models.whipple.coefficients({**data.problem.fixed, **dict(whipple.parameters), "v": name.x})
        roots = sorted(np.roots([float(c) for c in a]), key=lambda s: (abs(s.imag) < 1e-9, s.real))
        # one pair at these speeds, and two real roots
        expected = dict(zip(("weave", "castering", "capsize"), roots[-3:], strict=True))[name.text]
        height = expected.real if part == "growth" else abs(expected.imag) / (2 * math.pi)
        assert name.y == pytest.approx(height, rel=1e-9)


@pytest.mark.slow
def test_what_meets_hands_its_name_on():
    """Capsize and castering of a child's bicycle meet in an EP2 (exact), and the pair that leaves it has both names."""
    data = tmsopt.growth(tmsopt.solve("problems/childs_bicycle.toml", throw=False))
    (event,) = (c for c in data.events if c.kind == "EP2" and c.root.re < 0)
    ended = [m for m in data.modes if m.name in ("capsize", "castering") and abs(m.values[-1] - event.at) < 1e-6]
    (pair,) = (m for m in data.modes if m.name == "capsize + castering")
    assert len(ended) == 2
    for root in (*(m.roots[-1] for m in ended), pair.roots[0]):
        assert abs(root - event.root.re) < 1e-2  # points crowd there; roots go apart like the root of the distance
    assert np.all(pair.roots.imag > 0)
    assert all(np.all(m.roots.imag == 0) for m in ended)


def test_modes_are_the_roots_and_nothing_is_left_out(whipple):
    data = tmsopt.growth(whipple)
    total = sum(len(m.values) * (2 if m.roots.imag.any() else 1) for m in data.modes)
    assert data.roots.size - 4 * 6 <= total <= data.roots.size  # stretches of three points and fewer are not followed
    for mode in data.modes:
        k = np.searchsorted(data.values, mode.values)
        assert np.abs(data.roots[k] - mode.roots[:, None]).min(axis=1).max() == 0


@pytest.mark.slow
def test_axes_of_a_problem_in_si(robot):
    """Speed in km/h as typed; the design's roots times √(g/w) stand on the curves at its own speed, in 1/s and Hz."""
    data = tmsopt.growth(robot)
    upper, lower = plots.growth_figure(data).axes
    assert lower.get_xlabel() == "$v$ in km/h"
    assert (upper.get_ylabel(), lower.get_ylabel()) == ("growth rate in 1/s", "frequency in Hz")
    at = robot.parameters["v"] * 3.6
    assert vertical(upper)["design"] == pytest.approx(at, rel=1e-12)
    root = next(r for r in robot.roots if r.im > 0)
    for ax, value in ((upper, root.re), (lower, root.im / (2 * math.pi))):
        curves = [line.get_data() for line in ax.lines if len(line.get_xdata()) > 10]
        heights = [np.interp(at, x, y) for x, y in curves if x[-1] > at]
        assert min(abs(y - value * RATE) for y in heights) < 1e-6 * RATE
    plain = plots.draw_growth(tmsopt.growth(robot, over="Fr"), ax_of())
    assert "Froude" in plain.get_xlabel()
    assert "1/s" not in plain.get_ylabel()


def test_over_another_parameter_stability_ends_where_the_roots_say(robot):
    """Coefficients are no polynomials in a tilt; the place is found by halving."""
    data = tmsopt.growth(robot, over="lambda_s")
    (event,) = (c for c in data.events if c.kind == "weave")
    for step, stable in ((-1e-9, True), (1e-9, False)):
        assert is_stable_60(polynomial_60(**{**robot.dimensionless, "lambda_s": event.at + step})) is stable
    ax = plots.draw_growth(data, ax_of())
    assert vertical(ax)["weave"] == pytest.approx(math.degrees(event.at), rel=1e-12)
    assert ax.get_xlabel() == r"$\lambda_s$ in deg"


@pytest.mark.slow
def test_a_general_system_flutters():
    """Ziegler (1952): p = 41/28 + b²/2."""
    ax = plots.draw_growth(tmsopt.solve("problems/ziegler.toml"), ax_of())
    marked = vertical(ax)
    assert marked["flutter"] == pytest.approx(41 / 28 + 0.1**2 / 2, rel=1e-12)
    assert set(words(ax)) == {"pair 1", "pair 2"}
    assert "weave" not in marked


@pytest.mark.slow
@pytest.mark.parametrize("name", ["point_mass_robot", "whipple_ep4"])
def test_every_event_is_in_sight(name):
    design = tmsopt.solve(f"problems/{name}.toml", throw=False)
    events = tmsopt.speeds(design).found
    low, high = plots.draw_growth(design, ax_of()).get_xlim()
    assert all(low <= c.at < high for c in events)  # these files have plain numbers or m/s


@pytest.mark.slow
def test_the_command_draws_over_what_is_asked(tmp_path):
    picture = tmp_path / "tilt.svg"
    for over, status in (("lambda_s", 0), ("lambda", 2)):
        arguments = ["solve", "problems/ep4.toml", "--plot", str(picture), "--over", over]
        done = CliRunner().invoke(main, arguments)
        assert done.exit_code == status, done.output
    assert "lambda_s" in done.stderr
    assert picture.stat().st_size > 10_000


# Charts and traces


@pytest.fixture(scope="module")
def chart(robot_file):
    return tmsopt.chart(robot_file, points=(60, 50))


def test_colours_of_the_abscissa_are_centred_at_0(chart, robot):
    ax = plots.draw_chart(chart, ax_of(), "abscissa", design=robot)
    (mesh,) = (c for c in ax.collections if isinstance(c, QuadMesh))
    assert mesh.norm(0.0) == 0.5
    assert mesh.norm(0.3) - 0.5 == pytest.approx(0.5 - mesh.norm(-0.3), rel=1e-12)
    lightness = [mcolors.rgb_to_hsv(mesh.cmap(x)[:3])[1] for x in (0.0, 0.5, 1.0)]
    assert lightness[1] < 0.1 < min(lightness[0], lightness[2])  # no colour at 0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$v$ in km/h", r"$\lambda_s$ in deg")
    assert (ax.get_xlim(), ax.get_ylim()) == ((pytest.approx((2, 20)), pytest.approx((1, 60))))
    assert np.allclose(mesh.get_array(), chart.abscissa, equal_nan=True)


@pytest.mark.slow
def test_the_star_says_whether_it_is_the_optimum(chart, robot, tmp_path):
    def star(found):
        ax = plots.draw_chart(found, ax_of(), "abscissa")
        (line,) = (line for line in ax.lines if line.get_marker() == "*")
        return (line.get_xdata()[0], line.get_ydata()[0]), line.get_label()

    place, label = star(chart)
    assert place == pytest.approx((robot.parameters["v"] * 3.6, math.degrees(robot.parameters["lambda_s"])), rel=1e-6)
    assert label.startswith("optimum")
    path = tmp_path / "asks_nothing.toml"
    path.write_text(ROBOT + '[constraints]\narm = "abs(u_H) >= 0.02"\n')
    found = tmsopt.chart(path, points=(30, 20))
    place, label = star(found)
    assert label.startswith("least abscissa on the grid")
    least = found.to_json()["least_abscissa"]
    assert place == pytest.approx((least["v"] * 3.6, math.degrees(least["lambda_s"])), rel=1e-12)
    assert float(label.split()[-1]) == pytest.approx(least["value"], rel=1e-3)


def test_a_layer_that_is_not_there_and_a_space_are_refused(chart, tmp_path):
    with pytest.raises(tmsopt.InputError, match="did you mean 'abscissa'"):
        plots.draw_chart(chart, layer="absissa")
    path = tmp_path / "three.toml"
    path.write_text(ROBOT.replace('"-16 cm"', '{ min = "-20 cm", max = "-10 cm" }'))
    with pytest.raises(tmsopt.InputError, match="found 3 parameters"):
        plots.draw_chart(tmsopt.chart(path, points=(4, 4, 4)))


def test_a_trace_has_the_colours_of_its_abscissa():
    """At EP4 the abscissa is −12.5^(1/4), the least there is (Table 1); widths tell what is stable."""
    found = tmsopt.trace("problems/ep_set.toml", starts=4)
    ax = plots.draw_trace(found, ax_of())
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$\\mathrm{Fr}$", r"$\lambda_s$ in deg")
    (band,) = (c for c in ax.collections if isinstance(c, LineCollection))
    (branch,) = found.branches
    assert len(band.get_segments()) == len(branch) - 1
    k = int(np.argmin(band.get_array()))
    assert band.get_array()[k] == pytest.approx(-(12.5**0.25), abs=0.05)  # of a step's two ends the middle
    (ep4,) = (e for e in found.events if e.name == "EP4")
    x, y = band.get_segments()[k].mean(axis=0)
    place = [ep4.parameters[n] for n in ("Fr", "lambda_s")]
    assert [x, math.radians(y)] == pytest.approx(place, abs=0.05)
    assert {line.get_linestyle() for line in ax.lines if len(line.get_xdata()) > 1} == {"-", "--"}  # 2EP2 and CEP2


# Fronts and studies


def test_a_histogram_counts_every_row_once():
    """Around a marginal design: half a per cent of speed decides. No bin holds stable and unstable designs."""
    problem = tmsopt.load("problems/whipple_benchmark.toml")
    design = tmsopt.solve(replace(problem, fixed={**problem.fixed, "v": WEAVE}))
    data = tmsopt.run_study(tmsopt.monte_carlo(design, 60, tolerances={"v": 0.02}), workers=1)
    ax = plots.draw_histogram(data, ax_of())
    assert sum(patch.get_height() for patch in ax.patches) == 60
    stable = sum(r.varied["v"] > WEAVE for r in data.rows)
    assert 0 < stable < 60
    assert ax.get_title().splitlines()[-1].startswith(f"{stable} of 60 stable")
    for patch in ax.patches:
        low, high = patch.get_x(), patch.get_x() + patch.get_width()
        assert low >= -1e-15 or high <= 1e-15
        assert patch.get_height() == 0 or (low >= -1e-15) == (patch.get_hatch() in (None, ""))  # decay is to the right
    assert ax.get_xlabel().startswith("decay rate in 1/s")


@pytest.mark.slow
def test_another_study_is_drawn_over_what_varies():
    study = tmsopt.over_grid("problems/ep4.toml", {"zeta_H": [-0.3, -0.2, -0.1]})
    data = tmsopt.run_study(study, workers=1)
    ax = plots.draw_histogram(data, ax_of())
    (line,) = ax.lines
    assert line.get_xdata().tolist() == [-0.3, -0.2, -0.1]
    # the root of Table 1 for any heights: −(ζ_B ζ_H)^(−1/4)
    assert line.get_ydata().tolist() == pytest.approx([-((0.4 * z) ** -0.25) for z in (0.3, 0.2, 0.1)], rel=1e-9)


# The others


def test_the_ruler_has_the_published_speeds(whipple):
    ax = plots.draw_speeds(tmsopt.speeds(whipple), ax_of())
    marks = {round(line.get_xdata()[0], 12) for line in ax.lines if len(line.get_xdata()) == 2}
    assert {round(WEAVE, 12), round(CAPSIZE, 12)} <= marks
    band = next(p for p in ax.patches if p.get_label() == "stable")
    assert (band.get_x(), band.get_x() + band.get_width()) == (pytest.approx(WEAVE), pytest.approx(CAPSIZE))
    assert {"weave 4.292", "capsize 6.024"} <= set(words(ax))


def test_roots_are_drawn_in_1_per_s_with_their_multiplicity():
    design = tmsopt.solve("problems/ep4.toml")
    ax = plots.draw_roots(design, ax_of())
    (place,) = (line.get_xydata()[0] for line in ax.lines if line.get_marker() == "s")
    assert tuple(place) == pytest.approx((-(12.5**0.25), 0), abs=1e-9)
    assert words(ax) == ["4-fold"]
    proof = tmsopt.prove(design)
    title = plots.draw_roots(proof, ax_of()).get_title()
    assert "proved, each number within" in title
    assert float(title.split()[-1]) == pytest.approx(proof.radius, rel=0.5)  # one digit


def test_the_bars_of_robustness_make_up_the_distance():
    near = tmsopt.robustness(tmsopt.solve("problems/ep4.toml"))
    ax = plots.draw_robustness(near, ax_of())
    lengths = [patch.get_width() for patch in ax.patches]
    assert math.hypot(*lengths) == pytest.approx(100 * near.radius, rel=1e-4)  # bars of a thousandth are left out


def test_a_split_of_a_fourfold_root_has_the_slope_of_a_fourth_root():
    (found,) = tmsopt.diagnose(tmsopt.solve("problems/ep4.toml"))
    for line in plots.draw_splitting(found, ax_of()).lines:
        x, y = np.log(line.get_xdata()), np.log(line.get_ydata())
        assert (y[1] - y[0]) / (x[1] - x[0]) == pytest.approx(1 / 4, rel=1e-12)


@pytest.fixture(scope="module")
def results(whipple, chart):
    """A result for each function that draws one."""
    ep4 = tmsopt.solve("problems/ep4.toml")
    return {
        "growth": whipple,
        "frequencies": whipple,
        "roots": tmsopt.optimality(ep4),
        "chart": chart,
        "domain": chart.domain,
        "trace": tmsopt.trace("problems/ep_set.toml", starts=2),
        "speeds": tmsopt.speeds(whipple),
        "rounding": tmsopt.explain(ep4),
        "robustness": tmsopt.nearest(ep4, "weave"),
        "splitting": tmsopt.diagnose(ep4)[0],
        "comparison": tmsopt.compare(ep4),
        "bicycle": ep4,
        "motion": tmsopt.simulate(ep4, lean=5),
        "loop": tmsopt.encircle("problems/loss_only_dimer.toml", radius=0.1),
        "petermann": tmsopt.growth("problems/pt_dimer.toml", over="g", petermann=True),
        "ledger": tmsopt.verify(only=["epset*"]),
        "designs": tmsopt.solve_all("problems/ep4_matching.toml"),
    }


ELSEWHERE = {"front", "histogram", "swallowtail", "distance", "sheets"}
NAMES = sorted({name.removeprefix("draw_") for name in dir(plots) if name.startswith("draw_")} - ELSEWHERE)
"""Every public picture but those that are tried in other tests."""


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.slow
def test_every_picture_is_drawn_on_the_axes_given_or_on_its_own(results, name):
    draw, ax = getattr(plots, f"draw_{name}"), ax_of()
    assert draw(results[name], ax) is ax
    assert ax.has_data()
    own = draw(results[name])
    figure = own.get_figure(root=True)
    assert figure is not ax.get_figure(root=True)
    figure.draw_without_rendering()
    frame = figure.bbox
    for text in (*own.texts, own.title, own.xaxis.label, own.yaxis.label):  # nothing is cut off
        box = text.get_window_extent()
        assert not text.get_text() or (box.x0 >= -1 and box.x1 <= frame.x1 + 1 and box.y0 >= -1), text.get_text()


def test_one_design_far_away_hides_no_other():
    """Forty values within 1 of 3, one at −1700: that one is counted, not shown."""
    near = import_module("tmsopt.plots.study")._find_comparable
    values = np.append(np.linspace(2.0, 4.0, 40), (-1700.0, np.nan))
    assert near(values).tolist() == [True] * 40 + [False, False]


def test_letters_that_no_font_has_cost_no_warning(tmp_path):
    """Drawn as boxes; warnings are errors here."""
    ax = tmsopt.plots.draw_growth(tmsopt.growth(PROBLEMS / "whipple_benchmark.toml"))
    ax.set_title("自行车 \U0001f6b2")
    tmsopt.plots.save(ax, tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 1000

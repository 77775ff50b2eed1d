"""Figures by the data that they draw, against closed forms and independent computations; files only at the end."""

import json
import math

import mpmath
import numpy as np
import pytest
import sympy
from click.testing import CliRunner
from helpers.commands import tmsopt
from helpers.designs import designs
from helpers.oracles import is_stable_60, polynomial_60
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tmsopt import laws
from tmsopt.cli import command_group as main
from tmsopt.paper import (
    benchmark,
    ep_set,
    experiment,
    experimental,
    heavy_section,
    multiple_roots,
    optimised_benchmark,
    sketch,
    spire,
    spire_faces,
    table_1,
    table_1_loci,
    table_1_paths,
)
from tmsopt.plots import Name, draw_bicycle, draw_distance, new_figure, place_names
from tmsopt.plots.paper import (
    GALLERY,
    draw_box,
    draw_critical_speeds,
    draw_row,
    draw_section,
    find_item,
    full_window,
)
from tmsopt.records import Table

ROUNDING = 1e-13
"""Relative; a few hundred operations in double precision."""

OMEGA0 = -(12.5**0.25)  # Table 1
FR_EP4 = 3 * math.sqrt(110 * math.sqrt(2) - 120) / 8  # Table 1
FR_C_EP4 = math.sqrt(30 * math.sqrt(2) + 120) / 8  # Table 1


def axes(**options):
    return Figure().add_subplot(**options)


def drawn(ax, gid):
    """Points of the lines with this label, as arrays of shape (n, 2)."""
    return [line.get_xydata() for line in ax.lines if line.get_gid() == gid]


# Designs of the paper


def test_designs_are_the_printed_ones():
    """Ten printed digits, of which the last is off by up to two."""
    names = ("Fr", "mu", "chi_B", "chi_H", "zeta_B", "zeta_H", "lambda_s")
    p = benchmark().parameters
    assert p["Fr"] == pytest.approx(0.9070641497, abs=2e-10)
    assert [p[n] for n in names[1:]] == pytest.approx([0.1, 1.2, 1.02, -0.4, -0.2, math.pi / 36])
    p = optimised_benchmark().parameters
    assert [p[n] for n in ("Fr", "mu", "lambda_s", "chi_B")] == pytest.approx(
        [2.337214017, 20.84626701, 0.8514403685, 1.19], rel=5e-10
    )
    assert [b.parameters["lambda_s"] for b in table_1()] == pytest.approx(
        [math.atan(15 / 4 - 75 * math.sqrt(2) / 32) + offset for offset in (0, -0.05, 0.8)], rel=ROUNDING
    )
    assert table_1()[0].parameters["Fr"] == pytest.approx(FR_EP4, rel=ROUNDING)


# The bicycle


@pytest.mark.parametrize("p", [benchmark().parameters, optimised_benchmark().parameters, *designs(20)])
def test_drawn_geometry_is_that_of_the_equations(p):
    ax, near = axes(), axes()
    draw_bicycle(sketch(p), ax)
    draw_distance(sketch(p), near)
    expected = (p["chi_H"] - 1) * math.cos(p["lambda_s"]) - p["zeta_H"] * math.sin(p["lambda_s"])  # below `matrices`
    mass, foot = drawn(near, "distance")[0]
    assert mass == pytest.approx([p["chi_H"], p["zeta_H"]])
    for axis in (drawn(ax, "axis")[0], drawn(near, "axis")[0]):
        low, high = axis
        along = (high - low) / np.linalg.norm(high - low)
        assert math.atan2(-along[0], -along[1]) == pytest.approx(p["lambda_s"], abs=ROUNDING)  # leans back, z is down
        for point in ((1.0, 0.0), foot):  # the front contact is on the axis: there is no trail; and so is the foot
            offset = point - low
            assert abs(along[0] * offset[1] - along[1] * offset[0]) < ROUNDING
        assert abs((mass - foot) @ along) < ROUNDING  # and the segment stands on it at a right angle
    assert np.linalg.norm(mass - foot) == pytest.approx(abs(expected), abs=ROUNDING)
    assert sketch(p).nu_H == pytest.approx(expected, abs=ROUNDING)
    assert ax.get_aspect() == near.get_aspect() == 1.0  # to scale
    low, high = ax.get_ylim()
    assert low > high  # z points down
    balls = {patch.get_gid(): patch.center for patch in ax.patches if patch.get_gid() in ("B", "H")}
    assert balls == {"B": (p["chi_B"], p["zeta_B"]), "H": (p["chi_H"], p["zeta_H"])}


# Growth


# Root locus


@pytest.fixture(scope="module")
def rows():
    return table_1_loci()


def test_the_root_locus_shows_the_roots_of_the_law(rows):
    """At χ_B = √2 complex roots have |s| = |ω0| until the EP, and cross the axis at Fr_c; both pairs meet at CEP2."""
    for row, end in zip(rows, (FR_EP4, 2.257421384, 4.103508160), strict=True):
        ax, tilt = axes(), row.bicycle.parameters["lambda_s"]
        draw_row(ax, row, full_window(row), 1)
        (circle,) = drawn(ax, "circle")
        assert np.hypot(*circle.T) == pytest.approx(-OMEGA0, rel=ROUNDING)
        law = row.loci[0]
        assert law.design == pytest.approx(end, abs=1e-8)  # printed to nine decimals
        before = np.concatenate([m.roots for m in law.modes if m.values[-1] <= end + 1e-8 and m.roots.imag.any()])
        assert before.size > 200
        assert np.abs(before) == pytest.approx(-OMEGA0, abs=1e-6)
        expected = np.concatenate([m.roots for data in row.loci for m in data.modes])
        points = np.concatenate(drawn(ax, "track"))
        assert set(map(tuple, np.abs(points))) == set(zip(abs(expected.real), abs(expected.imag), strict=True))
        (crossing,) = drawn(ax, "crossing")
        assert crossing == pytest.approx(np.array([[0, -OMEGA0], [0, OMEGA0]]), rel=1e-12)
        (onset,) = (c.at for c in law.events if c.changes)
        assert onset == pytest.approx(float(laws.frm(-0.4, -0.2, tilt)), rel=1e-12)
        for data in row.loci[1:]:  # off the law there is none
            assert {name for name, _, _ in multiple_roots(data)} == {"EP2"}


# The experimental bicycle


def critical_60(**geometry):
    """Fr where a1 a2 a3 = a0 a3² + a4 a1² at 60 digits: a1 and a3 are linear and a2 is quadratic in Fr."""
    rest, unit = polynomial_60(Fr=0, **geometry), polynomial_60(Fr=1, **geometry)
    a0, a1, _, a3, a4 = unit
    return float(mpmath.sqrt((a0 * a3 / a1 + a4 * a1 / a3 - rest[2]) / (unit[2] - rest[2])))


@pytest.fixture(scope="module")
def built():
    return experiment()


def test_critical_speeds_are_those_of_the_roots(built):
    ax = axes()
    draw_critical_speeds(ax, built)
    p = experimental().parameters
    curves = [line for line in ax.lines if len(line.get_xdata()) > 100]
    assert [(c.chi_H, c.mu) for c in built.critical[1:]] == [(0.921, 0.1), (0.921, 1.0), (0.921, 3.0)]
    for line, data in zip(curves, built.critical, strict=True):
        x, y = line.get_xydata().T
        geometry = {n: p[n] for n in ("zeta_B", "zeta_H")} | {"chi_H": data.chi_H, "lambda_s": built.lambda_s}
        geometry["mu"] = 1.0 if math.isnan(data.mu) else data.mu
        for k in range(20, len(x), 110):
            assert y[k] == pytest.approx(critical_60(chi_B=x[k], **geometry), rel=1e-11)  # cancels near the poles
            assert is_stable_60(polynomial_60(Fr=y[k] * 1.001, chi_B=x[k], **geometry))
            assert not is_stable_60(polynomial_60(Fr=y[k] * 0.999, chi_B=x[k], **geometry))
        near = [critical_60(chi_B=data.minimum[0] + step, **geometry) for step in (-1e-3, 0.0, 1e-3)]
        assert near[1] == pytest.approx(data.minimum[1], rel=1e-12)
        assert near[1] < min(near[0], near[2])
        assert np.nanmin(y) >= data.minimum[1] * (1 - ROUNDING)
        for edge in data.flat_range:
            assert critical_60(chi_B=edge, **geometry) == pytest.approx(1.01 * data.minimum[1], rel=1e-10)


def test_optimum_at_chi_H_1_is_the_law(built):
    """A minimum is found to the square root of rounding; its value to rounding."""
    ratio = 1.158 / 0.526
    assert built.critical[0].minimum[0] == pytest.approx(math.sqrt(ratio), abs=1e-6)
    r = math.sqrt(ratio)
    assert built.critical[0].minimum[1] == pytest.approx(
        math.sqrt((r + 1) / (r - 1) * math.tan(built.lambda_s)), rel=1e-12
    )


def test_less_tilt_than_stated_is_not_stable(built):
    p = experimental().parameters
    for tilt, stable in ((built.least_tilt + 0.01, True), (built.least_tilt - 0.01, False)):
        a = [
            laws.copo(Fr, 0.1, p["chi_B"], p["chi_H"], p["zeta_B"], p["zeta_H"], tilt)
            for Fr in np.linspace(0.1, 20, 50)
        ]
        assert any(np.roots(c).real.max() < 0 for c in a) is stable
    for curve in experiment(built.least_tilt - 0.01).critical[1:]:
        assert np.isnan([*curve.Fr_c, *curve.minimum, curve.experimental_Fr_c, *curve.flat_range]).all()


# The universal chart


def heavy_exact(A1, A2, A3):
    """Whether all four roots are real and negative, by exact root counts (Sturm) of rational coefficients."""
    s = sympy.Symbol("s")
    p = sympy.Poly([1, A1, A2, A3, 1], s)
    return sum(root.is_negative * m for root, m in p.real_roots(multiple=False)) == 4


def test_heavy_damping_in_the_section_by_exact_counts():
    """Between A2 = 2 A1 − 2 and 2 + A1²/4 for A1 ≥ 4, on rational points and on the two boundaries themselves."""
    for A1 in [sympy.Rational(n, 4) for n in range(1, 33, 3)]:
        low, high = heavy_section(float(A1))
        near = [edge + sympy.Rational(n, 1000) for edge in (2 * A1 - 2, 2 + A1**2 / 4) for n in (-1, 0, 1)]
        for A2 in [*near, *(sympy.Rational(n, 5) for n in range(-15, 95, 7))]:
            expected = heavy_exact(A1, A2, A1)
            assert expected == bool(
                low <= float(A2) <= high
            )  # exact in binary where it decides: quarters and sixteenths
    assert heavy_exact(4, 6, 4)


def test_spire_bounds_heavy_damping():
    """Its points have a double root among four real ones; a little to either side the count changes."""
    faces = spire_faces(8.0)
    for face in faces:
        assert face.shape == (41, 41, 3)
        assert face[0] == pytest.approx(np.tile([4.0, 6.0, 4.0], (41, 1)))  # EP4
        assert np.maximum(face[-1, :, 0], face[-1, :, 2]) == pytest.approx(8.0, rel=1e-12)
    for face in faces[:2]:
        assert face[:, 0] == pytest.approx(ep_set(face[:, 0, 0]), rel=1e-12)  # the 2EP2 edge, of two faces
    assert faces[2][:, -1] == pytest.approx(faces[0][:, -1], rel=1e-12)  # the EP3 edges, each of two faces
    assert faces[2][:, 0] == pytest.approx(faces[1][:, -1], rel=1e-12)
    m, t = 0.3, 0.2
    x = math.exp(m)
    assert np.concatenate([[1], spire(m, t), [1]]) == pytest.approx(
        np.poly([-x, -x, -math.exp(t) / x, -math.exp(-t) / x]), rel=ROUNDING
    )
    counts = set()
    for face in faces:
        for k in (15, 30):
            above, below = (
                heavy_exact(*map(sympy.Rational, map(float, face[k, 20] + [0, step, 0]))) for step in (1e-4, -1e-4)
            )
            assert above != below
            counts.add(above)
    assert counts == {True, False}  # one face bounds from below, two from above


def test_drawn_paths_are_those_of_table_1():
    """Stability begins at A2 = A1/A3 + A3/A1; the exceptional point is of the EP set, EP4 is (4, 6, 4)."""
    paths = table_1_paths()
    box, section = axes(projection="3d"), axes()
    draw_box(box, paths, spire_faces(8.0))
    draw_section(section, paths)
    solid = [line.get_data_3d() for line in box.lines if line.get_gid() == "path"]
    speeds = (FR_C_EP4, FR_EP4), (1.482682090, 2.257421384), (3.934331969, 4.103508160)  # Fr_c, and of the EP
    for path, flat, (x, y, z), (Fr_c, Fr_EP) in zip(paths, drawn(section, "path"), solid, speeds, strict=True):
        assert path.stability_onset[1] == pytest.approx(2, abs=1e-12)
        assert path.A[:, 0] == pytest.approx(path.A[:, 2], rel=1e-12)
        assert path.exceptional_point == pytest.approx(ep_set(path.exceptional_point[0]), rel=1e-12)
        shown = (path.A[:, 0] <= 8) & (path.A[:, 1] <= 18)
        assert flat == pytest.approx(path.A[shown, :2])
        assert np.stack([x, z, y], axis=1) == pytest.approx(path.A[shown], rel=1e-12)
        # at χ_H = 1, A1 is proportional to Fr
        assert path.stability_onset[0] / path.exceptional_point[0] == pytest.approx(Fr_c / Fr_EP, abs=1e-8)
        (mark,) = drawn(section, path.name)
        assert mark[0] == pytest.approx(path.exceptional_point[:2])
    assert paths[0].exceptional_point == pytest.approx([4, 6, 4], rel=1e-12)
    assert paths[1].exceptional_point[0] > 4 > paths[2].exceptional_point[0]
    assert {line.get_linestyle() for line in section.lines if line.get_gid() == "ep-set"} == {"--", "-"}


# The command


def test_list_and_names():
    assert find_item("fig3") is find_item("root-locus") is GALLERY["root-locus"]
    listed = json.loads(CliRunner().invoke(main, ["figure", "--list", "--json"]).stdout)["figures"]
    assert {"bicycle", "growth", "root-locus", "experiment", "universal"} <= {item["name"] for item in listed}
    assert {item["alias"] for item in listed} >= {"figTMS", "fig0", "fig3", "fige"}
    assert all(item["caption"].endswith(".") for item in listed)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("root-lokus", "did you mean 'root-locus'?"),
        ("fig9", "accepted:"),
        ("", "NAME: missing"),
        ("bicycle --output bicycle.jpg", "png, pdf, svg"),
        ("bicycle --output nowhere/bicycle.png", "does not exist"),
        ("bicycle --output bicycle.pdf --format svg", "svg"),
    ],
)
def test_bad_input_of_figure(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["figure", *arguments.split()])
    assert (done.exit_code, done.stdout) == (2, "")
    assert message in done.stderr
    assert isinstance(done.exception, SystemExit)  # no traceback
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_one_figure_is_written_whole(tmp_path):
    done = tmsopt("figure", "figTMS", "--format", "svg", "--json", cwd=tmp_path)
    assert done.returncode == 0
    (item,) = json.loads(done.stdout)["figures"]
    assert (item["name"], item["file"]) == ("bicycle", "bicycle.svg")
    assert (tmp_path / "bicycle.svg").read_text(encoding="utf-8").startswith("<?xml")
    assert [path.name for path in tmp_path.iterdir()] == ["bicycle.svg"]


@pytest.mark.slow
def test_all_figures_go_into_a_new_directory(tmp_path, monkeypatch):
    """With two figures that are quick to draw, in this process."""
    quick = Table({name: GALLERY[name] for name in ("bicycle", "experiment")})
    monkeypatch.setattr("tmsopt.plots.paper.GALLERY", quick)
    folder = tmp_path / "new" / "figures"
    done = CliRunner().invoke(main, ["figure", "all", "--output", str(folder)])
    assert (done.exit_code, done.stdout) == (0, "")
    assert sorted(path.name for path in folder.iterdir()) == ["bicycle.png", "experiment.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") and path.stat().st_size > 20_000 for path in folder.iterdir())
    assert done.stderr.splitlines() == [f"wrote {folder / name}.png" for name in quick]


# Names beside points


def test_names_stand_clear_of_curves_of_one_another_and_of_the_frame():
    ax = new_figure(4, 4).add_subplot(xlim=(0, 1), ylim=(0, 1))
    x = np.linspace(0, 1, 200)
    ax.plot(x, x, x, 1 - x)
    names = [Name("capsize and weave", 0.995, 0.5), Name("EP3", 0.5, 0.5), Name("EP4", 0.52, 0.53), Name("out", 2, 0.5)]
    place_names(ax, names)
    renderer = ax.figure.canvas.get_renderer()
    boxes = [t.get_window_extent(renderer) for t in ax.texts]
    assert [t.get_text() for t in ax.texts] == ["capsize and weave", "EP3", "EP4"]
    frame = ax.get_window_extent(renderer)
    for k, box in enumerate(boxes):
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1
        assert not any(box.overlaps(other) for other in boxes[:k])
        for line in ax.get_lines()[:2]:
            drawn = ax.transData.transform(line.get_xydata())
            assert not any(box.contains(*point) for point in drawn)


def test_points_that_fall_together_share_a_label():
    ax = axes(xlim=(0, 5), ylim=(0, 5))
    place_names(ax, [Name("EP4", 1.0, 2.0), Name("2EP2", 1.001, 2.0), Name("EP4", 1.0, 2.0)])
    place_names(ax, [])
    assert [t.get_text() for t in ax.texts] == ["EP4, 2EP2"]


def test_names_leave_the_layout_to_whoever_chose_it():
    for layout in (None, "tight", "constrained"):
        figure = Figure(layout=layout)
        FigureCanvasAgg(figure)
        engine, ax = figure.get_layout_engine(), figure.subplots()
        ax.plot([0, 1], [0, 1])
        place_names(ax, [Name("EP4", 0.5, 0.5)])
        assert figure.get_layout_engine() is engine
        assert [t.get_text() for t in ax.texts] == ["EP4"]

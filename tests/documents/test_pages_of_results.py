"""A result as one page: whole, closed in itself, the same numbers as the result has; in a browser and on paper."""

import base64
import json
import math
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from decimal import Decimal, localcontext
from functools import cache
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from helpers.browser import opened
from helpers.places import PROBLEMS

import tmsopt
from tmsopt.problem import unit_of
from tmsopt.roots import CLASSES

HOSTILE = '</title><script>alert(1)</script><b> & "quoted" $\\frac{ ]]> '
VOID = {"meta", "link", "img", "input", "br"}
HALF = 0.5000001  # of the last digit that is shown


def text_of(name):
    return (PROBLEMS / f"{name}.toml").read_text(encoding="utf-8")


@cache
def design():
    return tmsopt.solve(PROBLEMS / "ep4.toml")


@cache
def robot():
    """In SI, in units as they were typed."""
    return tmsopt.solve(PROBLEMS / "point_mass_robot.toml")


@cache
def infeasible():
    """EP4's bicycle, as fast a decay as at its best speed, at less than half of it; with a title of an enemy."""
    limits = {"decay": "abscissa <= -1", "slow": "Fr <= 1"}
    return tmsopt.solve(replace(design().problem, constraints=limits, title=HOSTILE), throw=False)


@cache
def charted():
    return tmsopt.chart(PROBLEMS / "chart.toml", points=(20, 20))


@cache
def traced():
    return tmsopt.trace(PROBLEMS / "ep_set.toml", step=0.05, starts=8)


@cache
def front():
    """Of s² + c s + 1: the abscissa is −c/2."""
    problem = tmsopt.Problem(
        tmsopt.models.from_coefficients([1, "c", 1]), free={"c": (0.5, 1.5)}, pareto=("abscissa", "c")
    )
    return tmsopt.pareto(problem, points=4)


@cache
def studied():
    return tmsopt.run_study(tmsopt.over_grid(design().problem, {"zeta_B": [-0.5, -0.4], "mu": [0.1, 0.2]}), workers=1)


@cache
def built():
    sample = tmsopt.monte_carlo(design().problem, 20, tolerances={"Fr": 0.02})
    return tmsopt.run_study(sample, workers=1)


RESULTS = {
    "design": design,
    "robot": robot,
    "infeasible": infeasible,
    "proof": lambda: tmsopt.prove(design()),
    "chart": charted,
    "trace": traced,
    "front": front,
    "study": studied,
    "built": built,
}
LONG = ("robot", "infeasible", "proof", "study")  # to make, or to write
each = pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n in LONG)) for n in RESULTS])


class Page(HTMLParser):
    """A page as it is read: what is open, where it leads, headings, tables, texts that are verbatim."""

    def __init__(self, text):
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.frames: list[str] = []
        self.headings: list[tuple[int, str]] = []
        self.badges: list[str] = []
        self.verbatim: dict[str, str] = {}
        self.tables: dict[str, list[list[str]]] = {}
        self._said: list[str] = []
        self._row: list[str] = []
        self._label = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        given = {name: value or "" for name, value in attrs}
        self.tags.append(tag)
        self.ids += [given["id"]] if "id" in given else []
        self.links += [given[name] for name in ("src", "href", "action", "poster", "srcset") if name in given]
        self.frames += [given["srcdoc"]] if "srcdoc" in given else []
        assert not [name for name in given if name.startswith("on")]
        if tag not in VOID:
            self.open.append(tag)
        if tag in ("h1", "h2", "h3", "caption", "th", "td", "pre", "span"):
            self._said = []
        self._label = given.get("aria-label", "") if tag == "pre" else self._label
        self._row = [] if tag == "tr" else self._row

    def handle_data(self, data):
        self._said.append(data)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        said = "".join(self._said)
        if re.fullmatch("h[1-6]", tag):
            self.headings.append((int(tag[1]), said))
        elif tag == "caption":
            self.tables[said] = []
        elif tag in ("th", "td"):
            self._row.append(said)
        elif tag == "tr":
            [*self.tables.values()][-1].append(self._row)
        elif tag == "pre":
            self.verbatim[self._label] = said.removeprefix("\n")  # of which a browser takes none either
        elif tag == "span":
            self.badges.append(said)


def save(result, folder, **options):
    """The text of its page."""
    tmsopt.save_report(result, folder / "page.html", **options)
    return (folder / "page.html").read_text(encoding="utf-8")


@cache
def written(name):
    """A page with its command and a file."""
    more = {"design": design()} if name == "proof" else {}
    with TemporaryDirectory() as folder:
        files = {"ep4.toml": text_of("ep4")}
        return save(RESULTS[name](), Path(folder), command="tmsopt solve '<b>.toml'", files=files, seed=3, **more)


@pytest.fixture
def file_of(tmp_path):
    """Writes the page of a name for a browser."""

    def write(name):
        (tmp_path / "p.html").write_text(written(name), encoding="utf-8")
        return tmp_path / "p.html"

    return write


@cache
def page(name):
    return Page(written(name))


def shown(cell, value, one=1.0):
    """Whether a cell is a number rounded to the digits that it has."""
    digits = cell.split("e", maxsplit=1)[0].lstrip("-").replace(".", "").lstrip("0")
    size = 10.0 ** (math.floor(math.log10(abs(value / one))) + 1 - max(len(digits), 5)) if value else 1e-12
    return abs(float(cell) - value / one) <= HALF * size


@pytest.mark.slow
@each
def test_a_page_is_whole_and_asks_for_nothing(name):
    read = page(name)
    assert read.open == []
    assert len(read.ids) == len(set(read.ids))
    assert all(link.startswith(("data:", "#")) for link in read.links)
    assert {link[1:] for link in read.links if link.startswith("#")} <= set(read.ids)
    style = re.findall(r"<style>(.*?)</style>", written(name), re.DOTALL)[0]
    assert "url(" not in style
    assert "@import" not in style
    assert "default-src 'none'" in written(name)
    assert read.tags.count("script") == read.tags.count("style") == read.tags.count("iframe") == 1
    assert {"header", "nav", "main", "dl", "details"} <= set(read.tags)
    levels = [level for level, _ in read.headings]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after <= before + 1 for before, after in pairwise(levels))


@pytest.mark.slow
@each
def test_pictures_lead_nowhere_either(name):
    """Drawings are read as XML; what they refer to is in themselves."""
    pictures = [link for link in page(name).links if link.startswith("data:image/svg+xml;base64,")]
    assert pictures or name == "built"
    for link in pictures:
        drawing = ET.fromstring(base64.b64decode(link.partition(",")[2]))
        targets = [v for e in drawing.iter() for a, v in e.attrib.items() if a.rpartition("}")[2] == "href"]
        assert all(target.startswith(("#", "data:image/png")) for target in targets)
        assert not {e.tag.rpartition("}")[2] for e in drawing.iter()} & {"script", "foreignObject", "text"}


@pytest.mark.parametrize(
    "name", [n if n in ("design", "trace") else pytest.param(n, marks=pytest.mark.slow) for n in RESULTS]
)
def test_the_page_says_where_it_is_from(name):
    read = page(name)
    texts = {"ep4.toml": text_of("ep4"), "command": "tmsopt solve '<b>.toml'"}
    assert read.verbatim.items() >= (texts | {"report as text": RESULTS[name]().report()}).items()
    assert f"<dt>NumPy</dt><dd>{np.__version__}</dd>" in written(name)
    assert f"<dt>seed</dt><dd>{0 if name in ('study', 'built') else 3}</dd>" in written(name)


@pytest.mark.parametrize("name", [pytest.param("chart", marks=pytest.mark.slow), "front"])
def test_the_same_result_has_the_same_page(name, tmp_path):
    """But for the date."""
    one, two = (re.sub(r"<dt>date</dt><dd>[^<]*", "", save(RESULTS[name](), tmp_path)) for _ in range(2))
    assert one == two


@pytest.mark.parametrize(
    "name", ["design", *(pytest.param(n, marks=pytest.mark.slow) for n in ("robot", "infeasible"))]
)
def test_a_design_has_its_status_and_its_parameters(name):
    solution, read = RESULTS[name](), page(name)
    data = solution.to_json()
    assert read.badges[0] == data["status"]
    assert ("stable" in read.badges) is bool(data["stable"])
    assert ("proved" in read.badges) is bool(data["bound"]["proven"])
    assert data["structure"] in read.badges
    head, *rows = read.tables["Parameters of the design"]
    listed = {row[0]: dict(zip(head, row, strict=True)) for row in rows}
    for of in solution.problem.posed.parameter_set.parameters:
        unit, row = unit_of(solution.problem.posed, of.name), listed[of.name]
        assert shown(row["value"], solution.parameters[of.name], unit.factor), of.name
        assert row.get("unit", "") == unit.text
        assert row["meaning"] == of.meaning
        assert row["free or fixed"] == ("free" if of.name in solution.problem.free else "fixed")
        ends = [unit.number(x, 12) for x in solution.problem.free.get(of.name, ())]
        assert [end.split()[0] for end in row["range"].split(" … ") if end] == ends


@pytest.mark.slow
def test_quantities_are_those_of_the_design():
    solution = robot()
    head, *rows = page("robot").tables["Quantities of the design"]
    assert head[:3] == ["quantity", "value", "unit"]
    assert len(rows) > 5
    for name, value, unit, _ in rows:
        one = 0.01 if unit == "%" else unit_of(solution.problem.posed, name).factor
        assert float(value) == pytest.approx(solution.quantities[name] / one, rel=1e-5, abs=1e-9), name


@pytest.mark.slow
def test_what_limits_are_worth():
    """As the explanation has it, the most valuable first."""
    solution, tables = robot(), page("robot").tables
    levers = tmsopt.explain(solution, resolve=False).levers
    worth = tables["Effect of the active limits"][1:]
    assert [row[0] for row in worth] == [lever.name for lever in levers]
    for row, lever in zip(worth, levers, strict=True):
        assert float(row[-1].split()[0]) == pytest.approx(lever.predicted / lever.gained.factor, rel=5e-3)
    stands = {row[0]: row[-1] for row in tables["Limits and their status"][1:]}
    assert stands["steer_arm"] == "active"
    assert stands["rear_wheel_holds"] == f"holds by {solution.quantities['N_R'] - 20:.4g} N"
    assert set(stands) == set(solution.problem.constraints)


@pytest.mark.slow
def test_an_infeasible_page_says_what_is_violated_and_what_to_try():
    solution, text = infeasible(), written("infeasible")
    assert solution.status == "infeasible"
    stands = {row[0]: row[-1] for row in page("infeasible").tables["Limits and their status"][1:]}
    for name, amount in solution.violations.items():
        assert stands[name] == f"violated by {amount:.4g}"
    both = "infeasible: no design was found that meets both decay (abscissa &lt;= -1) and slow (Fr &lt;= 1)"
    assert f'<p class="answer">{both}</p>' in text
    assert "<p>smallest change found: " in text


@pytest.mark.slow
def test_a_title_is_text():
    """In the head, the heading, the report and the explorer, whatever is in it."""
    read = page("infeasible")
    assert read.headings[0] == (1, " ".join(HOSTILE.split()))
    assert read.tags.count("script") == 1
    assert "b" not in read.tags
    (inner,) = read.frames
    assert "<script>alert" not in inner
    assert Page(inner).tags.count("h1") == 1


@pytest.mark.slow
def test_every_proved_digit_is_there():
    proof, read = RESULTS["proof"](), page("proof")
    digits = {row[0]: row[1:3] for row in read.tables["Numbers that were proved, to 30 digits"][1:]}
    for name in proof.moved:
        assert digits[name] == [proof.parameters[name].value, f"± {proof.parameters[name].radius}"]
    assert digits["abscissa"][0] == proof.abscissa.value
    assert len(digits["chi_B"][0].replace(".", "")) >= 30
    with localcontext(prec=60):
        off = abs(Decimal(digits["chi_B"][0]) - Decimal(2).sqrt())  # of the closed form
    assert off <= Decimal(digits["chi_B"][1].removeprefix("± "))
    assert read.badges[0] == "proved"


def test_a_proved_bound_is_given_to_all_digits():
    bound = design().bound
    assert bound.proven
    (found,) = re.findall(r"<p>bound: ([^<]*)", written("design"))
    printed = found.split(" (")[0].split()[-1]
    assert bound.value - 1e-11 < float(printed) <= bound.value  # on its safe side
    assert len(printed.strip("-").replace(".", "")) == 12


@pytest.mark.parametrize("name", ["design", "chart", "trace", "front", "built"])
def test_the_explorer_opens_at_what_was_found(name):
    """With the edges of stability around it, where there are two axes for them."""
    (frame,) = page(name).frames
    data = json.loads(re.findall(r"^const DATA = (.*);$", frame, re.MULTILINE)[0])
    opened = data["designs"][0]
    assert data["start"] == opened["values"]
    assert bool(data["curves"]) is (name in ("design", "chart", "trace"))
    if name == "trace":
        assert (opened["name"], opened["roots"][0][2]) == ("EP4", 4)
    if name == "front":
        assert opened["values"] == [1.5]
        assert opened["abscissa"] == pytest.approx(-0.75, abs=1e-12)
        assert {d["name"] for d in data["designs"]} >= {"least abscissa", "least c"}
    if name in ("chart", "built"):
        found = charted().abscissa if name == "chart" else [row.abscissa for row in built().rows]
        assert opened["abscissa"] == pytest.approx(float(np.nanmin(found)), rel=1e-6 if name == "chart" else 1e-9)


def test_designs_of_a_chart():
    chart = charted()
    head, *rows = page("chart").tables["Designs of the grid"]
    assert head[:3] == ["Fr", "lambda_s rad", "class"]
    assert len(rows) == 400
    for row, kind, abscissa in zip(rows, chart.kind.ravel(), chart.abscissa.ravel(), strict=True):
        assert row[2] == CLASSES[kind]
        assert shown(row[3], float(abscissa))
    assert {tuple(map(float, row[:2])) for row in rows} == {
        (float(f"{x:.6g}"), float(f"{y:.6g}")) for x in chart.grid[0] for y in chart.grid[1]
    }
    classes = {name: float(share) for name, share in page("chart").tables["Share of each class"][1:]}
    assert sum(classes.values()) == pytest.approx(100, abs=0.05)


def test_large_tables_are_thinned_and_say_so(tmp_path):
    text = save(tmsopt.chart(PROBLEMS / "chart.toml", points=(80, 60), boundaries=False), tmp_path)
    rows = Page(text).tables["Designs of the grid"][1:]
    assert len(rows) == 40 * 30 <= 2000
    assert "1200 of 4800 designs, spread evenly over each axis; --output writes all." in text


def test_a_space_in_a_folder_has_a_page_without_a_picture(tmp_path):
    chart = tmsopt.chart(PROBLEMS / "ep_set.toml", points=(20, 20, 20), folder=tmp_path / "space.chart")
    read = Page(save(chart, tmp_path))
    assert len(read.tables["Designs of the grid"][1:]) == 10**3
    assert "img" not in read.tags
    assert read.verbatim["report as text"] == chart.report()


def test_points_and_events_of_a_trace():
    trace, tables = traced(), page("trace").tables
    tables_of = [tables[f"Events along branch {k}, to all digits"] for k in range(1, len(trace.branches) + 1)]
    events = [row for table in tables_of for row in table[1:]]
    assert [row[0] for row in events] == [event.name for event in trace.events]
    ep4 = next(row for row in events if row[0] == "EP4")
    assert float(ep4[2]) == pytest.approx(math.sqrt(2), abs=1e-11)  # chi_B, a closed form of the paper
    points = tables["Points of the branches"]
    assert len(points) - 1 == trace.points
    assert points[0][:2] == ["branch", "Fr"]
    assert [float(row[1]) for row in points[1:]] == [
        float(f"{x:.6g}") for branch in trace.branches for x in branch.parameters["Fr"]
    ]


def test_points_of_a_front():
    head, *rows = page("front").tables["Points of the front"]
    assert head[:2] == list(front().objectives)
    assert all(float(a) == pytest.approx(-float(c) / 2, abs=1e-11) for a, c, *_ in rows)
    listed = [tuple(float(f"{x:.12g}") for x in point.objectives) for point in front().points]
    assert [tuple(map(float, row[:2])) for row in rows] == listed


@pytest.mark.parametrize("name", [pytest.param("study", marks=pytest.mark.slow), "built"])
def test_rows_of_a_study(name):
    results, read = RESULTS[name](), page(name)
    head, *rows = read.tables["Rows of the study"]
    assert [int(row[0]) for row in rows] == list(range(len(results.rows)))
    for row, found in zip(rows, results.rows, strict=True):
        assert shown(row[head.index("abscissa")], found.abscissa)
        assert (row[1] == "yes") is bool(found.stable)
    assert read.badges[0] == f"{len(results.rows)} rows"


@pytest.mark.slow
def test_every_result_has_a_page(tmp_path):
    from test_results import RESULTS as every, made

    for name in every:
        read = Page(save(made(name), tmp_path))
        assert read.open == []
        assert read.tags.count("script") == 1
        assert read.verbatim["report as text"] == made(name).report()


def test_what_cannot_be_written_is_said(tmp_path):
    for result, path, words in (
        (design(), tmp_path / "x.pdf", r"path: found '.*x\.pdf'; accepted: a file name ending in html, htm"),
        (3, tmp_path / "x.html", "result: found 3; accepted: a result"),
        (design(), 3, "accepted: the path of"),
    ):
        with pytest.raises(tmsopt.InputError, match=words):
            tmsopt.save_report(result, path)
    with pytest.raises(OSError, match="No such file"):
        tmsopt.save_report(tmsopt.describe("tms"), tmp_path / "none" / "x.html")


COMMANDS = {
    "solve": ["solve", "ep4.toml"],
    "prove": ["prove", "ep4.toml", "--seed", "5"],
    "chart": ["chart", "chart.toml", "--points", "20", "--no-boundaries"],
    "trace": ["trace", "ep_set.toml", "--step", "0.05", "--starts", "8"],
    "front": ["solve", "pareto.toml", "--points", "4"],
    "all": ["solve", "ep4_matching.toml", "--all", "--seconds", "1"],
}


@pytest.mark.parametrize(
    "name", [n if n in ("chart", "trace") else pytest.param(n, marks=pytest.mark.slow) for n in COMMANDS]
)
def test_a_command_writes_its_page(name, tmp_path, monkeypatch, run):
    """With --json too, which is the same as without a page."""
    monkeypatch.chdir(PROBLEMS)
    words, path = COMMANDS[name], tmp_path / "a page.html"
    status, out, err = run(*words, "--json", "--report", path)
    assert (status, err) == (0, f"wrote {path}\n")
    data = json.loads(out)
    assert [*data][:3] == ["schema", "title", "model"]
    assert data.get("proved", True)
    read = Page(path.read_text(encoding="utf-8"))
    assert read.verbatim["command"] == f"tmsopt {' '.join(words)} --json --report '{path}'"
    assert read.verbatim[words[1]] == (PROBLEMS / words[1]).read_text(encoding="utf-8")


def test_a_study_has_the_file_of_its_problem_too(tmp_path, monkeypatch, run):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ep4.toml").write_text(text_of("ep4"), encoding="utf-8")
    study = 'problem = "ep4.toml"\n[study]\nseed = 7\n[vary]\nmu = [0.1, 0.2]\n'
    (tmp_path / "two.toml").write_text(study, encoding="utf-8")
    status, _, err = run("study", "two.toml", "--workers", "1", "--report", "two.html")
    assert (status, err.splitlines()[-1]) == (0, "wrote two.html")
    text = (tmp_path / "two.html").read_text(encoding="utf-8")
    assert Page(text).verbatim["two.toml"] == study
    assert Page(text).verbatim["ep4.toml"] == text_of("ep4")
    assert "<dt>seed</dt><dd>7</dd>" in text


@pytest.mark.parametrize("command", ["solve", "prove", "chart", "trace", "study"])
def test_an_ending_is_refused_before_any_work(command, run):
    said = "--report: found 'page.pdf'; accepted: a file name ending in html, htm\n"
    assert run(command, "none.toml", "--report", "page.pdf") == (2, "", said)


@pytest.mark.slow
def test_a_design_so_far_has_a_page(tmp_path):
    for status, said in (
        ("not_converged", "stopped before the end, the best design so far"),
        ("optimal", ", stopped before it was proved"),
    ):
        assert said in save(replace(design(), status=status, interrupted=True, bound=tmsopt.Bound()), tmp_path)


def test_large_matrices_have_a_page_without_the_explorer(tmp_path):
    rows = [[str(i + 2) if i == j else 0 for j in range(7)] for i in range(7)]
    rows[0][:2], rows[1][:2] = ["d + 1j*g", 1], [1, "-1j*g"]
    model = tmsopt.models.from_hamiltonian(rows)
    point = tmsopt.solve(tmsopt.Problem(model, free={"d": (-0.5, 0.7), "g": (0.5, 2.0)}, locate="EP2"))
    assert "Move a parameter" not in save(point, tmp_path)


# In a browser


def column(page, table, number):
    """Cells of a column, of the rows that are seen."""
    rows = page.locator("section", has=page.locator("caption", has_text=table)).locator("tbody tr:visible")
    return [str(text) for text in rows.locator(f":nth-child({number})").all_inner_texts()]


@pytest.mark.slow
def test_rows_are_sorted_and_filtered(browser, file_of):
    """By keyboard; the order is that of numbers, and comes back; opened watched, so that nothing fails or is asked for."""
    with opened(browser, file_of("chart")) as page:
        before = column(page, "Designs of the grid", 4)
        head = page.get_by_role("columnheader", name="abscissa").last
        button = head.get_by_role("button")
        for sense, reverse in (("ascending", False), ("descending", True)):
            button.press("Enter")
            assert head.get_attribute("aria-sort") == sense
            numbers = [float(cell) for cell in column(page, "Designs of the grid", 4)]
            assert numbers == sorted(map(float, before), reverse=reverse)
        button.press("Enter")
        assert head.get_attribute("aria-sort") == "none"
        assert column(page, "Designs of the grid", 4) == before
        page.get_by_label("Rows with").fill("HEAVILY damped")
        known = int((charted().kind == CLASSES.index("heavily damped")).sum())
        assert column(page, "Designs of the grid", 3) == ["heavily damped"] * known
        assert page.get_by_role("status").last.inner_text() == f"{known} of 400 rows"


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=pytest.mark.long)])
@pytest.mark.parametrize("name", ["design", "infeasible", "chart", "study"])
def test_the_page_is_accessible_and_fits(browser, file_of, name, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed").Axe()
    for width in (400, 2500):
        with opened(browser, file_of(name), width=width, color_scheme=scheme) as page:
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            found = axe.run(page).response["violations"]
            assert [(v["id"], [n["target"] for n in v["nodes"]]) for v in found] == []


@pytest.mark.slow
def test_without_scripts_the_page_is_all_there(browser, file_of):
    file, noted = file_of("chart"), []
    with browser.new_context(java_script_enabled=False) as plain:
        page = plain.new_page()
        page.goto(file.as_uri())
        assert page.locator("tbody tr").count() > 400
        assert page.locator("thead button").count() == 0
    with opened(browser, file, faults=noted) as page:
        assert page.locator("thead button").count() > 0
    assert noted == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["design", "chart"])
def test_the_page_prints(browser, file_of, name):
    """On A4; what is folded is open, what moves is left out, nothing is cut at the right; 100 rows of 400."""
    with opened(browser, file_of(name)) as page:
        sheets = page.pdf(format="A4", print_background=True)
        assert 2 <= len(re.findall(rb"/Type\s*/Page\b", sheets)) <= 8
        page.emulate_media(media="print")
        page.set_viewport_size({"width": 688, "height": 1000})  # of A4 less its margins, in CSS pixels
        assert not page.locator("iframe").is_visible()
        assert name == "design" or page.locator("#rows tbody tr:visible").count() == 100
        assert page.evaluate("document.documentElement.scrollWidth") <= 688
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert page.locator("details[open] pre").is_visible()
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert page.locator("details[open]").count() == 0

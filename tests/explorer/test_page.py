"""The page in Chromium: what it says is what the package computes, it needs nothing, and everybody can use it."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.browser import drawn, press

import tmsopt
from tmsopt.problem import array_function

pytestmark = pytest.mark.slow

PAGE = Path(tmsopt.__file__).parent / "explorer" / "page"
NAMES = ("ep4", "whipple_ep4", "point_mass_robot", "pt_pair", "three_masses")
MARKUP = "<script>alert(1)</script><b>"
HOSTILE = f"""title = "{MARKUP} /* script */ <!-- title -->"
[model]
name = "{MARKUP}"
coefficients = ["1", "c", "k"]
[parameters]
c = {{ min = -1, max = 3 }}
k = 1
[objective]
minimize = "abscissa"
"""


@pytest.fixture(params=NAMES)
def explored(request, made):
    return made(request.param)


def values_of(page):
    """The parameters that the page shows, in SI."""
    return page.evaluate("[...state.x]")


def verdict(page):
    return " ".join(page.inner_text("#verdict").split())


def typed(page, name, text):
    """A number into the field of a parameter."""
    field = page.get_by_role("textbox", name=re.compile(rf"^{re.escape(name)}( in .*)?$"))
    field.fill(text)
    field.press("Enter")


def parameters(page):
    return page.evaluate("DATA.parameters")


def kind(roots):
    """The class by the roots themselves, for designs away from all boundaries."""
    real = np.abs(roots.imag) == 0
    if roots.real.max() < 0:
        return "heavily damped" if real.all() else "stable"
    return "capsize" if (roots[real].real >= 0).any() else "weave"


def test_names_are_given_once(made):
    """In one classic script the later of two functions of a name silently replaces the earlier."""
    written, _, _ = made("ep4")[0].html.partition("const DATA = ")
    texts = [written, *(p.read_text() for p in sorted(PAGE.glob("*.js")))]
    names = re.findall(r"^(?:async )?function (\w+)", "\n".join(texts), re.MULTILINE)
    assert len(names) > 50
    assert [n for n in names if names.count(n) > 1] == []


def test_it_opens_without_a_fault_and_goes_to_known_designs(show, explored):
    """There the roots are those that were found, with their multiplicity; and back again."""
    explorer, path = explored
    with show(path) as page:
        start = values_of(page)
        assert start == [explorer.solution.parameters[n] for n in explorer.problem.posed.parameter_set.names]
        way, grows = explorer.solution.abscissa, explorer.solution.stability.growth
        assert verdict(page).startswith("✓" if way < 0 else "✗" if way > 0 or grows else "≈ marginal")
        assert page.locator(".picture canvas").count() > 0
        assert page.title() == explorer.problem.title
        for design in page.evaluate("DATA.designs"):
            press(page, design["name"])
            assert values_of(page) == design["values"]
            assert design["structure"] in verdict(page)
            assert page.evaluate("tmsopt.get().abscissa") == design["abscissa"]
            assert page.evaluate("tmsopt.get().roots.length") == page.evaluate("MODEL.degree")
            multiple = [n for _, im, n in design["roots"] if n > 1 and im >= 0]
            assert page.inner_text(".roots").count("-fold") == len(multiple)
        assert start == page.evaluate("DATA.designs[0].values")  # so that a button "start" would say nothing new
        assert page.get_by_role("button", name="start", exact=True).count() == 0


def test_a_state_is_what_the_package_computes(show, explored):
    """Random designs, free and fixed parameters alike: a few typed into the fields, others set by a program."""
    explorer, path = explored
    problem, random = explorer.problem, np.random.default_rng(19)
    compared = 0
    with show(path) as page:
        known, quantities = parameters(page), page.evaluate("DATA.quantities")
        asked = {q["name"]: problem.posed.read(q["name"]) for q in quantities}
        for number in range(24):
            texts = [repr(random.uniform(p["low"], p["high"]) / p["one"]) for p in known]
            values = {p["name"]: float(t) * p["one"] for p, t in zip(known, texts, strict=True)}
            if number < 3:
                for p, text in zip(known, texts, strict=True):
                    typed(page, p["name"], text)
            else:
                page.evaluate(
                    "(values) => tmsopt.set(values)", {p["name"]: values[p["name"]] / p["one"] for p in known}
                )
            drawn(page)
            assert values_of(page) == pytest.approx([*values.values()], rel=3e-16)
            of_python = problem.posed.values(values)["structure"]
            if not of_python.roots:
                continue
            mine = np.array([complex(r.re, r.im) for r in of_python.roots for _ in range(r.multiplicity)])
            found = page.evaluate("tmsopt.get()")
            theirs = np.array(found["roots"]) @ [1, 1j]
            size = np.abs(mine).max()
            assert max(np.abs(theirs - root).min() for root in mine) <= 1e-9 * size
            assert found["abscissa"] == pytest.approx(of_python.abscissa, abs=1e-9 * size)
            assert found["damping_ratio"] == pytest.approx(problem.posed.values(values)["damping_ratio"], abs=1e-8)
            assert found["kind"] == kind(mine)
            assert verdict(page).startswith("✓" if mine.real.max() < 0 else "✗")
            read = array_function(problem.posed, asked)(values)
            shown = page.locator("#quantities td.value").all_inner_texts()
            for (name, value), text in zip(found["quantities"].items(), shown, strict=False):
                expected = float(read[name]) / next(q["one"] for q in quantities if q["name"] == name)
                assert value == pytest.approx(expected, rel=1e-8, abs=1e-12, nan_ok=True), name
                assert (text == "not defined here") == math.isnan(expected)
            compared += 1
    assert compared >= 12  # some bicycles have no roots, but most do


def test_sliders_move_the_design(show, made):
    low, high = made("ep4")[0].problem.free["Fr"]
    with show("ep4") as page:
        before, said = values_of(page), verdict(page)
        places = [page.evaluate("tmsopt.get().parameters.Fr")]
        slider = page.get_by_role("slider", name=re.compile("^Fr, "))
        for key in ("ArrowRight", "Shift+ArrowRight", "End", "Home"):
            slider.press(key)
            drawn(page)
            places.append(page.evaluate("tmsopt.get().parameters.Fr"))
        assert np.diff(places[:3]) == pytest.approx([(high - low) / 1000, (high - low) / 10000], rel=1e-9)
        assert places[3:] == [high, low]
        assert verdict(page).startswith("✗ unstable")  # a bicycle that stands falls over
        assert page.inner_text("#said").startswith("unstable: ")
        assert page.get_attribute("#said", "aria-live") == "polite"
        for _ in range(4):
            page.keyboard.press("Control+z")
        drawn(page)
        assert values_of(page) == before
        assert verdict(page) == said


def test_a_drag_is_one_step(show):
    with show("ep4") as page:
        before = values_of(page)
        box = page.get_by_role("slider", name=re.compile("^Fr, ")).bounding_box()
        across, down = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(across, down)
        page.mouse.down()
        for k in range(10):
            page.mouse.move(across + 5 * k, down)
        drawn(page)
        assert page.inner_text("#said") == ""  # a screen reader is spared what passes by
        page.mouse.up()
        drawn(page)
        after = values_of(page)
        assert after != before
        page.keyboard.press("Control+z")
        assert values_of(page) == before
        page.keyboard.press("Control+Shift+z")
        assert values_of(page) == after
        page.keyboard.press("Control+z")
        page.keyboard.press("Control+y")
        assert values_of(page) == after


def test_a_number_field_refuses_nonsense(show):
    with show("ep4") as page:
        before = values_of(page)
        field = page.get_by_role("textbox", name="Fr", exact=True)
        for text in ("abc", "", "1e", "0x10", "NaN", "Infinity", "1 2", "12 34", "2 m/s", "1e999"):
            typed(page, "Fr", text)
            assert values_of(page) == before
            assert field.get_attribute("aria-invalid") == "true"
            assert page.inner_text(f"#{field.get_attribute('aria-describedby')}")
        field.press("Escape")
        assert field.get_attribute("aria-invalid") == "false"
        typed(page, "Fr", "2,5")
        drawn(page)
        assert 2.5 in values_of(page)
        assert field.get_attribute("aria-invalid") == "false"
        for name, text in (("Fr", "-1"), ("mu", "-0.1"), ("lambda_s", "90")):  # beyond what there is
            before = values_of(page)
            typed(page, name, text)
            assert values_of(page) == before
            assert "possible: " in page.locator("#controls .message:visible").last.inner_text()
            page.keyboard.press("Escape")
        typed(page, "Fr", "25")  # beyond the file's range, and possible
        drawn(page)
        assert 25 in values_of(page)
        assert page.get_by_role("slider", name=re.compile("^Fr, ")).input_value() == "1000"
        assert "beyond" in page.inner_text(f"#{field.get_attribute('aria-describedby')}")


def test_a_number_field_takes_what_people_write(show):
    with show("whipple_ep4") as page:
        at = {p["name"]: k for k, p in enumerate(parameters(page))}
        for text, value in (("3.5 m/s", 3.5), ("1 234.5", 1234.5), ("1\u202f234", 1234.0), ("2,5m/s", 2.5)):
            typed(page, "v", text)
            assert values_of(page)[at["v"]] == value
        typed(page, "v", "3.5 km/s")
        assert "a number in m/s is wanted" in page.inner_text("#controls .message:visible")


def test_a_number_field_shows_what_it_holds(show, explored):
    """To read with 9 digits; to write with as many as it takes to come back bit for bit."""
    _, path = explored
    with show(path) as page:
        start = values_of(page)
        of = {p["name"]: p for p in parameters(page)}
        for k, name in enumerate(page.locator(".row b").all_inner_texts()):
            field, p = page.get_by_role("textbox").nth(k), of[name]
            assert float(field.input_value().replace("−", "-")) == pytest.approx(p["value"] / p["one"], rel=5e-9)
            assert field.evaluate("(f) => f.scrollWidth <= f.clientWidth + 1"), field.input_value()  # all is seen
            field.focus()
            assert float(field.input_value()) * p["one"] == pytest.approx(p["value"], rel=3e-16, abs=0)
            field.fill(field.input_value() + " ")
            field.press("Enter")
        assert values_of(page) == start


def test_close_to_a_known_design_it_says_so(show):
    """Seven digits of an EP4 are none of it: its roots move as the fourth root of what is left out."""
    with show("ep4") as page:
        page.evaluate("change({x: [...state.x].map((value, k) => [k, Number(value.toPrecision(7))])})")
        drawn(page)
        assert "close to optimum, whose roots are sensitive: its button goes there" in verdict(page)
        typed(page, "Fr", "3")
        drawn(page)
        assert "close to" not in verdict(page)


VERDICTS = {
    "s^2 (s^2 + 1)": ('["1", "0", "1", "0", "k - 2"]', "✗ growing A disturbance grows as t: roots meet"),
    "undamped": (
        '["1", "0", "1 + k", "0", "k"]',
        "≈ marginally stable A disturbance neither grows nor dies out: the rightmost",
    ),
    "(s + k)^3": (
        '["1", "3*k", "3*k**2", "k**3"]',
        "✓ stable Every disturbance dies out and nothing swings, on the edge of heavy damping, slowest as t2 e−2 t",
    ),
    "(s + k)(s + 5)": (
        '["1", "5 + k", "5*k"]',
        "✓ heavily damped Every disturbance dies out and nothing swings, slowest as e−2 t",
    ),
    "(s^2 + s + 1)^2": ('["1", "2", "3", "2", "k - 1"]', "✓ stable Every disturbance dies out, slowest as t e−0.5 t"),
    "both grow": ('["1", "-k - 1", "k + 5", "-5"]', "✗ unstable Divergence and flutter: a disturbance grows as e1 t"),
    "one grows": ('["1", "3 - k", "3 - 2*k", "-4 + k"]', "✗ unstable Divergence: a disturbance grows as e"),
}


@pytest.mark.parametrize(("stated", "said"), VERDICTS.values(), ids=VERDICTS)
def test_the_verdict_of_plain_polynomials(show, stated, said):
    """At k = 2, by their factors: both grow is (s - 1)(s^2 - 2 s + 5); one grows s^3 + s^2 - s - 2."""
    text = f'title = "t"\n[model]\nname = "m"\ncoefficients = {stated}\n[parameters]\nk = 2\n'
    with show(text) as page:
        assert verdict(page).startswith(said)


def test_the_verdict_has_its_unit_and_its_reserve(show, made):
    of = {}
    for name in ("ep4", "whipple_ep4", "point_mass_robot"):
        with show(name) as page:
            of[name] = verdict(page)
            assert "--certify" not in page.inner_text("main")
            assert "(equation" not in page.inner_text("main")
            assert ("first it grows" in page.inner_text("#quantities")) == (name != "ep4")
    robot = made("point_mass_robot")[0].solution
    rate = robot.abscissa * math.sqrt(robot.parameters["g"] / robot.parameters["w"])
    shown = re.search(r"slowest as t3 e−([\d.]+) t, t in s", of["point_mass_robot"])
    assert -float(shown[1]) == pytest.approx(rate, rel=5e-4)
    assert "e−1.88 t · the rear wheel would lift (load −38 %)" in of["ep4"]
    assert "would lift" not in of["whipple_ep4"]


def test_limits_of_shares_are_read_in_percent(show, made):
    explorer, path = made("whipple_ep4")
    with show(path) as page:
        rear = page.locator("#limits li", has=page.get_by_text("rear", exact=True)).locator(".margin").inner_text()
        shown = re.fullmatch(r"holds by ([\d.]+) %", rear)
        assert float(shown[1]) == pytest.approx(
            100 * (explorer.problem.posed.values(explorer.solution.parameters)["load_rear"] - 0.1), rel=1e-3
        )
        assert page.evaluate("limitsInWords(drawingOf())") == "all limits hold"
        page.evaluate("change({x: [[0, NaN]]})")  # of a design that is none nothing is said
        assert page.evaluate("limitsInWords(drawingOf())") == ""


def test_it_prints_without_what_is_to_be_pressed(show):
    with show("ep4", width=794) as page:
        page.emulate_media(media="print")
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert page.locator("button:visible, select:visible, input[type=range]:visible").count() == 0
        assert page.locator("#sliders input:visible").count() == len(parameters(page))


def test_a_phone_shows_pictures_first(show):
    with show("ep4", width=400, height=800) as page:
        assert page.locator("#controls input:visible").count() == 0
        top = page.locator("#chart").bounding_box()["y"]
        bottom = page.locator("#controls").bounding_box()["y"]
        assert bottom - top > 400  # half of the screen at least
        page.set_viewport_size({"width": 1280, "height": 800})
        assert page.locator("#controls input:visible").count() > 0  # though there is no button to show them


def test_a_link_restores_the_state(show, explored):
    _, path = explored
    saved = "JSON.stringify([[...state.x], state.plane, state.over, state.layer])"
    with show(path) as page:
        assert page.evaluate("location.hash") in ("", "#")
        for p in parameters(page)[:2]:
            typed(page, p["name"], repr((p["low"] + p["high"]) / 3 / p["one"]))
        page.get_by_role("combobox", name="across").select_option(index=1)
        page.get_by_role("combobox", name="colours").select_option("damping")
        page.locator("#growth").get_by_role("combobox", name="over").select_option(index=1)
        drawn(page)
        state, link = page.evaluate(saved), page.evaluate("location.hash").removeprefix("#")
    with show(path, link=link) as page:
        assert page.evaluate(saved) == state
        assert page.inner_text("#note") == ""
        page.evaluate("location.hash = ''")
        drawn(page)
        assert page.evaluate("fragmentOf(state)") == ""
        page.keyboard.press("Control+z")
        assert page.evaluate(saved) == state


def test_what_a_link_says_wrongly_is_ignored_and_said(show):
    wrong = [
        "nobody=1",
        "Fr=abc",
        ".axes=Fr,Fr",
        ".axes=Fr",
        ".layer=toString",
        ".over=x",
        "%E0%A4%A=1",
        "<b>=1",
        "Fr=1e999",
    ]
    with show("ep4", link="&".join(["chi_B=1.75", *wrong, ".over=mu"])) as page:
        start, names = page.evaluate("DATA.start"), [p["name"] for p in parameters(page)]
        start[names.index("chi_B")] = 1.75
        assert values_of(page) == start
        assert page.evaluate("DATA.parameters[state.over].name") == "mu"
        note = page.inner_text("#note")
        assert all(part.split("%")[0] in note for part in wrong)


def test_the_link_is_copied_or_shown(show, made):
    with show("ep4") as page:
        typed(page, "Fr", "3.25")
        page.evaluate("Object.defineProperty(navigator, 'clipboard', {value: undefined, configurable: true})")
        press(page, "copy link")
        assert page.get_by_role("textbox", name="link").input_value() == f"{made('ep4')[1].resolve().as_uri()}#Fr=3.25"
        press(page, "close")
        page.evaluate(
            "Object.defineProperty(navigator, 'clipboard', {value: {writeText: async (text) => (window.copied = text)}})"
        )
        press(page, "copy link")
        assert page.evaluate("copied").endswith("#Fr=3.25")
        assert page.inner_text("#note") == "Link copied."


def test_a_saved_design_is_solved(show, explored, tmp_path):
    """With the parameters of the page, to the last digit but one."""
    _, path = explored
    with show(path) as page:
        for p in parameters(page)[:3]:
            typed(page, p["name"], repr((p["low"] + 2 * p["high"]) / 3 / p["one"]))
        drawn(page)
        with page.expect_download() as waiting:
            page.get_by_role("button", name="save design").click()
        name, values = waiting.value.suggested_filename, values_of(page)
        assert re.fullmatch(r"[a-z0-9-]+\.toml", name)
        waiting.value.save_as(tmp_path / name)
        names = [p["name"] for p in parameters(page)]
    problem = tmsopt.load(tmp_path / name)
    assert not problem.free
    assert [problem.fixed[n] for n in names] == [pytest.approx(v, rel=1e-15, abs=0) for v in values]
    assert tmsopt.solve(problem, throw=False).parameters == problem.fixed


def test_text_is_no_markup(show, tmp_path):
    (tmp_path / "hostile.toml").write_text(HOSTILE)
    explorer = tmsopt.explore(tmp_path / "hostile.toml")
    meaning = '"meaning":"\\u003cimg src=x onerror=alert(1)\\u003e"'
    changed = explorer.html.replace('"meaning":"parameter"', meaning)
    assert changed.count(meaning) == 2
    (tmp_path / "hostile.html").write_text(changed)
    with show(tmp_path / "hostile.html") as page:
        assert page.inner_text("h1") == f"{MARKUP} /* script */ <!-- title -->"
        assert page.title() == f"{MARKUP} /* script */ <!-- title -->"
        assert page.inner_text("#about") == MARKUP
        assert page.locator("img").count() == 0
        assert "<img src=x onerror=alert(1)>" in page.inner_text("#controls")
        assert page.evaluate("document.querySelectorAll('script').length") == 1


@pytest.mark.parametrize(("scheme", "width"), [("light", 400), ("dark", 1280)])
def test_it_is_accessible(show, explored, scheme, width):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")
    _, path = explored
    with show(path, width=width, color_scheme=scheme) as page:
        if width == 400:
            press(page, "show")
        typed_wrong = page.get_by_role("textbox").first
        typed_wrong.fill("wrong")
        typed_wrong.press("Enter")
        found = axe.Axe().run(page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]})
        assert [(v["id"], [n["target"] for n in v["nodes"]]) for v in found.response["violations"]] == []
        assert len(found.response["passes"]) > 10


def test_the_theme_is_that_of_the_system_until_one_is_chosen(show):
    with show("ep4", color_scheme="dark") as page:
        ground = "getComputedStyle(document.body).backgroundColor"
        dark = page.evaluate(ground)
        page.emulate_media(color_scheme="light")
        drawn(page)
        light = page.evaluate(ground)
        assert light != dark
        press(page, "theme: auto")
        assert page.evaluate(ground) == dark
        press(page, "theme: dark")
        assert page.evaluate(ground) == light


@pytest.mark.parametrize("width", [400, 1280])
def test_nothing_needs_scrolling_sideways(show, explored, width, tmp_path):
    explorer, path = explored
    long = tmp_path / "long.html"
    long.write_text(
        path.read_text().replace(
            f'"title":{json.dumps(explorer.problem.title, ensure_ascii=False)}', f'"title":"{"W" * 200}"'
        )
    )
    for shown in (path, long):
        with show(shown, width=width) as page:
            page.evaluate("document.querySelectorAll('details').forEach((d) => (d.open = true))")
            drawn(page)
            assert page.evaluate("document.documentElement.scrollWidth") <= width
            if width == 400:
                press(page, "show")
            slider = page.get_by_role("slider").first
            slider.scroll_into_view_if_needed()
            box = slider.bounding_box()
            on_top = page.evaluate(
                "([x, y]) => document.elementFromPoint(x, y).type",
                [box["x"] + box["width"] / 2, box["y"] + box["height"] / 2],
            )
            assert on_top == "range"  # nothing lies over it


@pytest.mark.parametrize("width", [400, 1280])
def test_targets_are_large_enough_for_fingers(show, width):
    with show("ep4", width=width, has_touch=True) as page:
        boxes = page.evaluate(
            "[...document.querySelectorAll('button, select, input, summary')].map((e) => [e.outerHTML, e.getBoundingClientRect()])"
            ".filter(([, b]) => b.width).map(([text, b]) => [text, b.width, b.height])"
        )
        main = [b for b in boxes if re.search(r"undo|copy link|save design|go to ", b[0])]
        assert len(main) >= 4
        assert [b for b in main if min(b[1:]) < 44] == []


def test_it_works_in_a_sandbox(show, made, tmp_path):
    """As in a notebook, where it has no address, no storage and no history."""
    explorer, _ = made("ep4")
    (tmp_path / "notebook.html").write_text(f"<!DOCTYPE html><title>notebook</title>{explorer._repr_html_()}")
    with show(tmp_path / "notebook.html") as host:
        frame = host.frames[1]
        said = frame.inner_text("#verdict")
        press(frame, "benchmark")
        assert frame.inner_text("#verdict") != said
        press(frame, "undo (Ctrl+Z)")
        assert frame.inner_text("#verdict") == said
        press(frame, "copy link")
        assert "no address" in frame.inner_text("#note")
        with host.expect_download() as waiting:
            frame.get_by_role("button", name="save design").click()
        assert tmsopt.load(waiting.value.path().rename(tmp_path / "saved.toml")).fixed == explorer.solution.parameters


def test_a_picture_that_fails_says_so_alone(show):
    faults = []
    with show("ep4", faults=faults) as page:
        page.evaluate("() => { survey = () => { throw new Error('out of paper'); }; }")
        typed(page, "chi_B", "1.5")
        drawn(page)
        assert "out of paper" in page.inner_text("#chart .message")
        assert page.locator("#plane .message:visible").count() == 0
        assert 1.5 in values_of(page)
    assert faults  # the browser may tell of one twice, or of a picture that was tried again
    assert all("out of paper" in fault for fault in faults)


def test_limits_are_lit(show, made):
    """Sign, words and margin of each limit against the problem's own judgement."""
    explorer, path = made("point_mass_robot")
    problem, random = explorer.problem, np.random.default_rng(20)
    with show(path) as page:
        for _ in range(8):
            free = {n: random.uniform(*ends) for n, ends in problem.free.items()}
            page.evaluate(
                "(x) => change({x})", [[problem.posed.parameter_set.names.index(n), x] for n, x in free.items()]
            )
            drawn(page)
            read = problem.posed.values({**problem.fixed, **free})
            margins = {
                "steer_arm": abs(read["u_H"]) - 0.02,
                "rear_wheel_holds": read["N_R"] - 20,
                "front_wheel_holds": read["N_F"] - 20,
            }
            for name, margin in margins.items():
                row = page.locator("#limits li", has=page.get_by_text(name, exact=True))
                assert row.get_attribute("class") == ("holds" if margin >= 0 else "broken")
                shown = re.search(r"(holds|violated) by ([\d.]+)", row.inner_text().replace("·10", "e"))
                scale = 100 if name == "steer_arm" else 1  # in cm, as the file has lengths
                assert float(shown[2]) == pytest.approx(abs(margin) * scale, rel=1e-4)

"""The pictures of the page in Chromium: what they show is what the package computes, and hands can move it."""

import numpy as np
import pytest
from helpers.browser import drawn, press
from helpers.places import PROBLEMS

import tmsopt

pytestmark = pytest.mark.slow

GRID = 200

POLE = """title = "A root at infinity"
[model]
coefficients = ["a", "1", "b"]
[parameters]
a = { min = -1, max = 1 }
b = { min = -1, max = 1 }
"""

ALONE = """title = "One parameter"
[model]
coefficients = ["1", "b", "1"]
[parameters]
b = { min = -1, max = 3 }
"""

CAR = """title = "A quarter of a car"
[model]
M = [["ms", 0], [0, 40]]
D = [["c", "-c"], ["-c", "c"]]
K = [["k", "-k"], ["-k", "k + 180000"]]
[parameters]
ms = 250
c = { min = 0, max = 6000 }
k = { min = 5000, max = 40000 }
[objective]
minimize = "abscissa"
"""

WINDOW = """title = "A narrow window"
[model]
coefficients = ["1", "1e-8 - (b - 1/3 - 1/1000)**2", "1"]
[parameters]
b = { min = 0, max = 1 }
"""

SWATCHES = """() => Object.fromEntries([...document.querySelectorAll("#chart .legend li")].map((item) => {
  const canvas = item.querySelector("canvas");
  const at = canvas.getContext("2d").getImageData(canvas.width / 2, canvas.height / 4, 1, 1).data;
  return [[...at].slice(0, 3).join(), item.textContent];
}))"""

PIXELS = """(grid) => {
  const canvas = document.querySelector("#chart canvas");
  const [x0, y0, width, height] = canvas.dataset.plot.split(" ").map(Number);
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return Array.from({ length: grid * grid }, (_, k) => {
    const x = Math.floor(x0 + (width * (k % grid)) / (grid - 1));
    const y = Math.floor(y0 + height - (height * Math.floor(k / grid)) / (grid - 1));
    const at = 4 * (Math.min(y, canvas.height - 1) * canvas.width + x);
    return [...data.slice(at, at + 3)].join();
  });
}"""


def plot_of(page, panel):
    """The corner and the size of a plot, in pixels of the window."""
    canvas = page.locator(f"#{panel} canvas").first
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    x0, y0, width, height = map(float, canvas.get_attribute("data-plot").split())
    return np.array([box["x"] + x0, box["y"] + y0]), np.array([width, height])


def drag(page, panel, *shares):
    """Press at the first place of a plot, move to the others, and let go; places as shares of width and depth."""
    corner, size = plot_of(page, panel)
    for k, share in enumerate(shares):
        page.mouse.move(*(corner + share * size))
        if not k:
            page.mouse.down()
    page.mouse.up()
    drawn(page)


def wait_until(page, condition):
    """Ten seconds at most; the page forbids the text that Playwright's own way would run."""
    for _ in range(200):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    pytest.fail(f"never came: {condition}")


def uniform(kind):
    """Where a design of a grid is of one class with all eight around it."""
    around = np.lib.stride_tricks.sliding_window_view(kind, (3, 3))
    same = np.zeros(kind.shape, dtype=bool)
    same[1:-1, 1:-1] = np.all(around == kind[1:-1, 1:-1, None, None], axis=(2, 3))
    return same


@pytest.mark.parametrize("name", ["chart", "ep_set"])
def test_colours_of_the_chart_are_the_classes_of_the_same_designs(show, name):
    """What a reader takes from the picture and its legend, against `tmsopt.chart`; without what is drawn above."""
    with show(name) as page:
        page.evaluate("DATA.curves.length = DATA.designs.length = 0")
        page.evaluate("change({ x: state.plane.map((k) => [k, rangeOf(k)[0]]) })")
        drawn(page)
        words, pixels = page.evaluate(SWATCHES), page.evaluate(PIXELS, GRID)
        start = dict(zip(*page.evaluate("[DATA.parameters.map(({ name }) => name), [...state.x]]"), strict=True))
        axes = page.evaluate("state.plane.map((k) => DATA.parameters[k].name)")
    problem = tmsopt.load(PROBLEMS / f"{name}.toml")
    plane = tmsopt.Problem(
        model=problem.model,
        fixed={n: v for n, v in start.items() if n not in axes},
        free={n: problem.free[n] for n in axes},
    )
    found = tmsopt.chart(plane, axes, points=(GRID, GRID), layers=["kind"], boundaries=False)
    codes = {"undefined": 0, "unstable by capsize": 1, "unstable by weave": 2, "stable": 3}
    codes["heavily damped (stable, nothing swings)"] = 4
    seen = np.array([codes.get(words.get(pixel, ""), -1) for pixel in pixels]).reshape(GRID, GRID)
    inner = uniform(found.kind)
    inner[:, :6] = inner[:6, :] = inner[:, -2:] = inner[-2:, :] = False  # the design's ring and the frame
    assert inner.mean() > 0.85
    assert len(np.unique(found.kind[inner])) >= 3
    assert np.array_equal(seen[inner], found.kind[inner])


def test_a_drag_on_the_chart_sets_the_parameters_of_its_place_in_one_step(show):
    with show("chart") as page:
        before = page.evaluate("[...state.x]")
        i, j = page.evaluate("state.plane")
        (low_i, high_i), (low_j, high_j) = page.evaluate("state.plane.map(rangeOf)")
        drag(page, "chart", [0.2, 0.3], [0.25, 0.5], [0.75, 0.4])
        after = page.evaluate("[...state.x]")
        # a pointer stands on whole pixels, and there are more than 200 of them along each axis
        assert after[i] == pytest.approx(low_i + 0.75 * (high_i - low_i), abs=0.005 * (high_i - low_i))
        assert after[j] == pytest.approx(low_j + 0.6 * (high_j - low_j), abs=0.005 * (high_j - low_j))
        assert {k for k, x in enumerate(after) if x != before[k]} == {i, j}
        page.evaluate("undo()")
        assert page.evaluate("[...state.x]") == before


def test_a_finger_moves_the_design_too(show):
    with show("chart", width=400, has_touch=True) as page:
        page.evaluate("document.getElementById('controls').hidden = true")  # they cover the chart until folded up
        low, high = page.evaluate("rangeOf(state.plane[0])")
        corner, size = plot_of(page, "chart")
        page.touchscreen.tap(*(corner + [0.75, 0.5] * size))
        drawn(page)
        touched = page.evaluate("state.x[state.plane[0]]")
        assert touched == pytest.approx(low + 0.75 * (high - low), abs=0.005 * (high - low))
        assert page.evaluate("document.documentElement.scrollWidth") <= 400


def test_arrow_keys_move_the_design_over_the_grid(show):
    with show("chart") as page:
        before = np.array(page.evaluate("state.plane.map((k) => state.x[k])"))
        steps = np.array([(high - low) / (GRID - 1) for low, high in page.evaluate("state.plane.map(rangeOf)")])
        page.focus("#chart canvas")
        for key in ("ArrowRight", "ArrowRight", "Shift+ArrowDown"):
            page.keyboard.press(key)
        after = np.array(page.evaluate("state.plane.map((k) => state.x[k])"))
        np.testing.assert_allclose(after, before + [2, -10] * steps, rtol=1e-12)
        outside = page.evaluate("rangeOf(state.plane[1])[1] + 1")
        page.evaluate(f"change({{ x: [[state.plane[1], {outside}]] }})")
        page.keyboard.press("ArrowRight")
        assert page.evaluate("state.x[state.plane[1]]") == outside


@pytest.mark.parametrize("name", ["whipple_benchmark", "ep4"])
def test_events_are_the_speeds_of_the_package(show, made, name):
    """Bisected signs, against exact roots of polynomials in the speed; of meetings those on the real axis."""
    explorer, path = made(name)
    with show(path) as page:
        events = page.evaluate("sweepOf(state).events")
        over, low, high = page.evaluate("[DATA.parameters[state.over].name, ...rangeOf(state.over)]")
    truth = tmsopt.speeds(explorer.solution, over, between=(low, high))
    changes = [(c.kind, c.at) for c in truth.found if c.changes and c.kind in ("weave", "capsize")]
    assert changes
    found = [(e["kind"], e["at"]) for e in events if e["kind"] in ("weave", "capsize")]
    assert [kind for kind, _ in found] == [kind for kind, _ in changes]
    np.testing.assert_allclose([at for _, at in found], [at for _, at in changes], rtol=1e-6)
    # at an EP4 of doubles the place of the meeting moves by the fourth root of a rounding
    meetings = [c.at for c in truth.exceptional if c.root.im == 0]
    np.testing.assert_allclose([e["at"] for e in events if e["kind"] == "meeting"], meetings, rtol=1e-3)


def test_a_window_that_the_design_stands_in_is_found(show):
    """Of s² + ((1e-4)² - (b - 1/3 - 1/1000)²) s + 1, where damping is positive for 2e-4 of the range."""
    with show(WINDOW) as page:
        middle = 1 / 3 + 1e-3
        assert growth_sentence(page) == "Unstable throughout; no crossing was found at 301 values."
        page.evaluate(f"change({{ x: [[0, {middle!r}]] }})")
        drawn(page)
        found = [(e["kind"], e["gains"], e["at"]) for e in page.evaluate("sweepOf(state).events")]
        assert [one[:2] for one in found] == [("weave", True), ("weave", False)]
        np.testing.assert_allclose([at for _, _, at in found], [middle - 1e-4, middle + 1e-4], atol=2e-10)


def test_tiny_numbers_are_told_from_0(show):
    """Their products underflow; one of two masses may be 1e-15 of the other."""
    with show(CAR) as page:
        assert page.evaluate(
            "[[1e-170, 1e-170, 1e-170], [1e-170, -1e-170, 1e-170]]"
            ".map((a) => crossingKind([1e-170, 1e-170, 1e-170], a))"
        ) == ["weave", "weave"]
        assert page.evaluate("crossingKind([1e-170, 1, 1e-170], [1e-170, 1, -1e-170])") == "capsize"
    light = '[model]\nM = [["1", "0"], ["0", "m"]]\nK = [["1", "0"], ["0", "1e-15"]]\n[parameters]\nm = 1e-15\n'
    with show(light) as page:
        end = page.evaluate("[...response(state.x, [1, 1, 0, 0], [Math.PI])]")
        np.testing.assert_allclose(end, [-1, -1, 0, 0], atol=1e-10)


def test_the_line_of_the_growth_plot_can_be_dragged_and_moved_by_keys(show):
    with show("whipple_benchmark") as page:
        low, high = page.evaluate("rangeOf(state.over)")
        drag(page, "growth", [0.5, 0.5], [0.25, 0.5])
        dragged = page.evaluate("state.x[state.over]")
        assert dragged == pytest.approx(low + 0.25 * (high - low), abs=0.005 * (high - low))
        page.focus("#growth canvas")
        page.keyboard.press("ArrowRight")
        assert page.evaluate("state.x[state.over]") == pytest.approx(dragged + (high - low) / 200, rel=1e-12)


@pytest.mark.parametrize("name", ["ep4", "point_mass_robot", "whipple_ep4"])
def test_the_bicycle_is_to_scale_and_moves_as_a_body(show, made, name):
    """The distance of H from the drawn axis is the quantity of the model; leaning and steering keep all distances."""
    explorer, path = made(name)
    values = explorer.problem.posed.values(explorer.solution.parameters)
    with show(path) as page:
        H, turned, foot, on_axis, moved, B, leaned, ahead = np.array(
            page.evaluate("""() => {
            const shape = bicycleShape(state.x);
            const { H, B } = shape;
            const [foot, axis] = [shape.onAxis(shape.alongAxis(H)), shape.onAxis(0.3)];
            const [turned, moved, ahead] = [H, axis, [10, 0, 0]].map((point) => movedPoint(shape, point, true, 0, 0.4));
            return [H, turned, foot, axis, moved, B, movedPoint(shape, B, false, 0.2, 0.4), ahead];
        }""")
        )
    arm = values["u_H" if "u_H" in values else "nu_H"]
    assert np.linalg.norm(H - foot) == pytest.approx(abs(arm), rel=1e-12)
    np.testing.assert_allclose(moved, on_axis, atol=1e-12)  # steering moves nothing on its axis
    assert np.linalg.norm(turned - foot) == pytest.approx(abs(arm), rel=1e-12)
    assert np.linalg.norm(leaned) == pytest.approx(np.linalg.norm(B), rel=1e-12)
    assert leaned[1] > 0  # a lean to the right, of what stands above the ground
    assert ahead[1] > 0  # a steer to the right


def test_time_of_the_motion_is_real(show):
    """From frame to frame by the moments of the frames, so that a busy machine does not matter; one frame of slack."""
    watch = """() => new Promise((done) => {
        const frames = [];
        const look = (moment) => {
            frames.push([moment / 1000, clock.time]);
            const [first, last] = [frames[0], frames[frames.length - 1]];
            if (last[0] - first[0] < 1) requestAnimationFrame(look);
            else done((last[1] - first[1]) / (last[0] - first[0]));
        };
        requestAnimationFrame(look);
    })"""
    with show("whipple_benchmark") as page:
        wait_until(page, "clock.time > 0.1")
        assert page.evaluate(watch) == pytest.approx(1, abs=0.05)
        page.locator("#bicycle select").last.select_option("10")
        assert page.evaluate(watch) == pytest.approx(0.1, abs=0.005)


@pytest.mark.parametrize("layer", ["kind", "abscissa", "damping"])
def test_pictures_stand_undefined_designs(show, layer):
    """A leading coefficient 0: no roots, no class. A page with faults or errors in its console fails in `opened`."""
    with show(POLE) as page:
        page.evaluate(f"change({{x: [[0, 0]], layer: '{layer}'}})")
        drawn(page)
        page.wait_for_timeout(600)
        assert not page.locator(".message:visible").count()
        assert "undefined" in page.get_attribute("#chart canvas", "aria-label")
        assert not page.is_visible("#bicycle")


def test_a_model_of_one_parameter_has_no_chart_and_says_so(show):
    with show(ALONE) as page:
        assert "needs two parameters" in page.inner_text("#chart")
        assert not page.locator("#sheets").count()
        assert page.is_visible("#growth canvas")


def test_pictures_say_what_they_show(show):
    with show("whipple_benchmark") as page:
        pictures = page.locator("canvas[aria-label]")
        told = pictures.evaluate_all("(all) => all.map((c) => [c.tabIndex, c.role, c.ariaLabel.length > 40])")
        assert sorted(told) == [[-1, "img", True]] * 3 + [[0, "application", True]] * 3
        assert "is stable" in page.get_attribute("#chart canvas", "aria-label")
        page.evaluate("change({x: [[state.over, 3]]})")
        page.wait_for_timeout(900)
        assert "is unstable by weave" in page.get_attribute("#chart canvas", "aria-label")
        assert "is unstable by weave" in page.get_attribute("#growth canvas", "aria-label")


def growth_sentence(page, change="{}"):
    page.evaluate(f"change({change})")
    drawn(page)
    return str(page.locator("#growth .reading").nth(1).inner_text())


def test_what_happens_on_the_way_is_said_without_what_the_ends_pretend(show):
    """A mass from 0 on, where its matrix is singular; the three roots that meet at the optimum; an undamped car."""
    index = "DATA.parameters.findIndex(({ name }) => name === '%s')"
    with show(CAR) as page:
        over_mass = growth_sentence(page, f"{{over: {index % 'ms'}}}")
        assert over_mass.startswith("Stable throughout")
        assert "a 3-fold root at 250 (this design)" in over_mass
        assert "edge of heavy damping" in page.inner_text("#chart .reading")
        growth_sentence(page, f"{{x: [[{index % 'c'}, 0]]}}")
        assert "marginal" in page.inner_text("#chart .reading")
        assert "within a multiple" not in page.inner_text("#motion")


def test_roots_that_cross_0_are_told_where_all_is_unstable(show):
    """The number of growing roots, by NumPy, changes there by as many as are said to cross."""
    with show("whipple_benchmark") as page:
        tilt = "DATA.parameters.findIndex(({ name }) => name === 'lambda_s')"
        assert growth_sentence(page, f"{{x: [[{tilt}, -0.3]]}}").startswith("Unstable throughout; ")
        events = page.evaluate("""sweepOf(state).events.filter(({ kind }) => kind === "crossing")
            .map(({ at, roots }) => ({
            roots,
            around: [-1e-4, 1e-4].map((step) => [...coefficientsAt(state.x, state.over, at + step)]) }))""")
    assert events
    for event in events:
        before, after = (np.count_nonzero(np.roots(a).real > 0) for a in event["around"])
        assert abs(after - before) == event["roots"]


def test_an_envelope_is_drawn_where_it_is_one(show):
    """Where four roots meet a push goes as t^3 e^(abscissa t), which no multiple of e^(abscissa t) bounds."""
    with show("ep4") as page:
        assert "within a multiple" not in page.inner_text("#motion")
        press(page, "benchmark")
        assert "within a multiple" in page.inner_text("#motion")


def test_one_pole_does_not_set_the_scale_of_the_growth_rates(show):
    """Robot, wheelbase: a root passes infinity beside the optimum, whose roots are at -11 1/s."""
    with show("point_mass_robot") as page:
        wheelbase = page.evaluate("DATA.parameters.findIndex(({ name }) => name === 'w')")
        low, high = page.evaluate(f"""() => {{
            change({{ over: {wheelbase} }});
            const curves = sweepOf(state).curves.flatMap(({{ points }}) => points.map(({{ re }}) => re));
            return growthLimits([-11, -11, -11, -11], [...curves, 1e5, -1e5], 11);
        }}""")
        assert low >= -60
        assert high <= 60
        page.evaluate(f"change({{ x: [[{wheelbase}, 10]] }})")
        drawn(page)
        assert "exact edges are hidden: other values are set" in page.inner_text("#chart .legend")
        fork = page.evaluate("""bicycleLines(bicycleShape(state.x), 0).filter(({ kind }) => kind === "fork")
            .flatMap(({ points }) => points.map((point) => point[2]))""")
        assert max(fork) <= 0  # none of it in the ground


def test_unstable_classes_are_told_apart_in_the_dark(show):
    """Relative luminance of the swatches, as WCAG has it: twice as bright at least."""
    with show("ep4", color_scheme="dark") as page:
        colours = {
            words: np.array(colour.split(","), dtype=float) / 255 for colour, words in page.evaluate(SWATCHES).items()
        }
    linear = {words: np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) for words, c in colours.items()}
    weave, capsize = (linear[f"unstable by {kind}"] @ [0.2126, 0.7152, 0.0722] + 0.05 for kind in ("weave", "capsize"))
    assert capsize >= 2 * weave

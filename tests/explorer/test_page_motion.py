"""The motion that the page shows, in Chromium: against integrated equations, and moved by hands."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.bicycles import MATRICES
from helpers.browser import drawn, press
from helpers.places import PROBLEMS
from scipy.integrate import solve_ivp

import tmsopt

pytestmark = pytest.mark.slow

PAGE = Path(tmsopt.__file__).parent / "explorer" / "page"
BICYCLES = ["whipple_benchmark", "point_mass_robot", "ep4"]
PAIR = """title = "Two carts"
[model]
M = [[1, 0], [0, 2]]
D = [["c", 0], [0, 0.3]]
K = [[3, -1], [-1, 2]]
[parameters]
c = { min = 0, max = 1, start = 0.2 }
"""

CLOSE = 1e-8
"""Of the largest value: the page repeats a step by a rounded exponential 600 times, the integrator works to 1e-12."""


def integrated(A, start, times):
    """States of z' = A z, time by time."""
    found = solve_ivp(lambda _, z: A @ z, (0, times[-1]), start, "DOP853", times, rtol=1e-12, atol=1e-14)
    return found.y.T


def first_order(M, D, K):
    M, D, K = (np.array(m, dtype=float) for m in (M, D, K))
    n = len(M)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])


def equations(explorer, values):
    """A of z' = A z for lean, steer and their rates, and the rates after an impulse of 1, in the units of the file."""
    if "I_Rxx" in values:  # of Whipple, by the published matrices
        M, C1, K0, K2 = (np.array(m) for m in MATRICES)
        return first_order(M, values["v"] * C1, 9.81 * K0 + values["v"] ** 2 * K2), np.linalg.solve(M, [0, 1])
    of, pencil = explorer.problem.posed.parameter_set, explorer.problem.model.pencil
    M, D, K = (np.array(m, dtype=float) for m in pencil(of.native(values)))
    rate, torque = (float(f(values)) if f else 1.0 for f in (of.rate, of.torque))
    in_file = (M * torque / rate**2, D * torque / rate, K * torque)  # N m per rad, N m s per rad, …
    return first_order(*in_file), np.linalg.solve(in_file[0], [0, 1])


def shown(page):
    return page.evaluate("Object.fromEntries(DATA.parameters.map(({name}, k) => [name, state.x[k]]))")


@pytest.mark.parametrize("name", BICYCLES)
@pytest.mark.parametrize(("lean", "push"), [(5, 0), (0, 0.2), (-3, 0.1)])
def test_the_motion_is_that_of_the_equations(show, made, name, lean, push):
    """Where the page opens: ep4 and the robot at fourfold roots."""
    explorer, path = made(name)
    with show(path) as page:
        found = page.evaluate(f"tmsopt.motion({{lean: {lean}, push: {push}, seconds: 3}})")
        A, impulse = equations(explorer, shown(page))
    assert found["t"][-1] == pytest.approx(3)
    truth = integrated(A, [np.radians(lean), 0, *(push * impulse)], found["t"])
    for k, angle in enumerate(("phi", "delta")):
        np.testing.assert_allclose(found[angle], truth[:, k], atol=CLOSE * np.abs(truth[:, :2]).max())


@pytest.mark.parametrize("name", BICYCLES)
def test_the_contacts_go_where_the_wheels_point(show, made, name):
    """psi' = (v delta + c delta') cos(lambda_s)/w, integrated beside the equations, in the lengths of the file."""
    explorer, path = made(name)
    with show(path) as page:
        times, contacts = page.evaluate("""() => {
            const system = systemOf(state.x);
            const motion = motionIn(system, startIn(system, {lean: 5, push: 0.1}), 3 * system.rate);
            return [motion.seconds, motion.seconds.map(motion.contacts)];
        }""")
        values = shown(page)
    A, impulse = equations(explorer, values)
    v, w, c = values.get("v", values.get("Fr")), values.get("w", 1.0), values.get("c", 0.0)
    cosine = np.cos(values["lambda_s"])
    whole = np.zeros((6, 6))
    whole[:4, :4] = A
    whole[4, [1, 3]] = np.array([v, c]) * cosine / w
    whole[5, 4] = v
    z = integrated(whole, [np.radians(5), 0, *(0.1 * impulse), 0, 0], times)
    rear = np.stack([v * np.array(times), z[:, 5]], axis=1)
    front = rear + np.stack([np.full(len(z), w), w * z[:, 4] - c * cosine * z[:, 1]], axis=1)
    truth = np.stack([rear, front], axis=1)
    for side in (0, 1):  # forward and to the right are of different size
        np.testing.assert_allclose(
            np.array(contacts)[:, :, side], truth[:, :, side], atol=CLOSE * np.abs(truth[:, :, side]).max()
        )


def test_a_slow_bicycle_falls_and_the_page_says_so(show, made):
    """The moment by the integrator; the page takes it between two of its 601 times, which is good to 1e-4."""
    explorer, path = made("whipple_benchmark")
    with show(path, reduced_motion="reduce") as page:
        page.evaluate("tmsopt.set({v: 0.5})")
        drawn(page)
        assert "It falls" in page.inner_text("#bicycle .reading")
        end, falls = page.evaluate("[motionFrom(state, drawingOf()).end, tmsopt.motion({seconds: 3}).falls]")
        A, _ = equations(explorer, shown(page))

        def fallen(_, z):
            return float(max(abs(z[0]) - np.pi / 6, abs(z[1]) - np.pi / 2))

        fallen.terminal = True  # type: ignore[attr-defined]
        truth = solve_ivp(
            lambda _, z: A @ z, (0, 20), [np.radians(5), 0, 0, 0], "DOP853", events=fallen, rtol=1e-12, atol=1e-14
        )
        assert end == pytest.approx(truth.t_events[0][0], rel=1e-4)
        assert falls == pytest.approx(end, rel=1e-4)
        page.select_option("#bicycle select", "1")
        press(page, "Play")
        page.wait_for_timeout(1000 * end + 1500)
        assert page.evaluate("clock.time") == end  # and stands
        assert page.get_by_role("button", name="Play", exact=True).is_visible()
        page.wait_for_timeout(500)
        assert page.get_attribute("#bicycle canvas", "aria-label").endswith("the bicycle falls.")
        page.evaluate("tmsopt.set({v: 5})")  # within the band of stable speeds, 4.292 to 6.024 m/s
        drawn(page)
        assert "It falls" not in page.inner_text("#bicycle")


def test_a_start_is_typed_and_kept(show, made):
    _, path = made("whipple_benchmark")
    start = "[state.lean, state.push]"
    with show(path, reduced_motion="reduce") as page:

        def typed(words, text):
            field = page.locator("#bicycle").get_by_role("textbox", name=re.compile(words))
            field.fill(text)
            field.press("Enter")
            return field

        typed("start lean", "−2,5°")
        typed("steer push", "1.5 N·m·s")
        drawn(page)
        assert page.evaluate(start) == [-2.5, 1.5]
        assert page.evaluate("motionFrom(state, drawingOf()).at(0, 0)") == pytest.approx(np.radians(-2.5))
        for text in ("30", "-31", "abc", ""):
            assert typed("start lean", text).get_attribute("aria-invalid") == "true"
        assert page.evaluate(start) == [-2.5, 1.5]
        link = page.evaluate("fragmentOf(state)")
        page.keyboard.press("Tab")
        page.get_by_role("button", name="undo (Ctrl+Z)").click()
        assert page.evaluate(start) == [-2.5, 0]
    with show(path, link=link) as page:
        assert page.evaluate(start) == [-2.5, 1.5]
    with show(path, link=".lean=30&.push=x&.lean=") as page:
        assert page.evaluate(start) == [5, 0]
        assert page.inner_text("#note").startswith("Ignored in the link: ")


def test_play_pause_restart_and_the_slider_by_keys(show, made):
    _, path = made("ep4")
    with show(path, reduced_motion="reduce") as page:
        before = page.evaluate("motionFrom(state, drawingOf()).at(0, 1)")
        slider = page.get_by_role("slider", name=re.compile("^Fr, "))
        for _ in range(20):
            slider.press("ArrowRight")
        drawn(page)
        assert abs(page.evaluate("motionKept.found.at(0, 1)") - before) > 1e-4  # what is drawn
        assert page.evaluate("clock.time") == 0
        play = page.get_by_role("button", name="Play", exact=True)
        play.focus()
        page.keyboard.press("Enter")
        page.wait_for_timeout(300)
        page.get_by_role("button", name="Pause", exact=True).press("Space")
        paused = page.evaluate("clock.time")
        assert paused > 0
        page.wait_for_timeout(200)
        assert page.evaluate("clock.time") == paused
        plane = "document.querySelectorAll('#bicycle canvas')[1].toDataURL()"
        tracks = page.evaluate(plane)
        page.get_by_role("button", name="Restart", exact=True).press("Enter")
        assert page.evaluate("clock.time") < paused + 0.2
        page.wait_for_timeout(200)
        assert page.evaluate(plane) != tracks


def test_a_stated_system_starts_from_each_of_its_states(show):
    with show(PAIR) as page:
        assert not page.is_visible("#bicycle")
        assert page.evaluate("tmsopt.motion({lean: 5})") is None
        c = shown(page)["c"]
        A = first_order([[1, 0], [0, 2]], [[c, 0], [0, 0.3]], [[3, -1], [-1, 2]])
        for k, name in enumerate(["coordinate 1", "coordinate 2", "rate of coordinate 1", "rate of coordinate 2"]):
            page.select_option("#motion select", name)
            times, values = page.evaluate("""() => {
                const { seconds, at } = motionFrom(state, drawingOf());
                return [seconds, seconds.map((time) => [at(0, time), at(1, time)])];
            }""")
            truth = integrated(A, np.eye(4)[k], times)[:, :2]
            np.testing.assert_allclose(values, truth, atol=CLOSE * np.abs(truth).max())


def test_a_model_by_its_coefficients_has_no_motion(show):
    with show('[model]\ncoefficients = ["1", "c", "1"]\n[parameters]\nc = { min = 0, max = 1 }\n') as page:
        assert not page.is_visible("#motion")
        assert page.evaluate("tmsopt.motion()") is None


def test_a_controller_with_a_lag_is_pushed_by_the_mass_of_the_bicycle(show, tmp_path):
    """T' = (-k phidot - T)/lag on the steering: five states, whose matrices I, -A have no mass in them."""
    lag, gain = 0.2, 8.0
    whipple = tmsopt.models.whipple

    def pencil(p):
        (a, b), (c, d) = whipple.pencil(p)[0]
        inverse = [[d / (a * d - b * c), -b / (a * d - b * c)], [-c / (a * d - b * c), a / (a * d - b * c)]]
        rows = [[0, 0, -1, 0, 0], [0, 0, 0, -1, 0]]
        for row in inverse:
            K, D = ([row[0] * m[0][k] + row[1] * m[1][k] for k in (0, 1)] for m in reversed(whipple.pencil(p)[1:]))
            rows.append([*K, *D, -row[1]])
        identity = [[float(i == k) for k in range(5)] for i in range(5)]
        return identity, [*rows, [0, 0, gain / lag, 0, 1 / lag]]

    def feedback(p):
        return SimpleNamespace(mass=whipple.pencil(p)[0])  # what the page asks of it

    posed = tmsopt.load(PROBLEMS / "whipple_benchmark.toml")
    model = replace(whipple, name="lagged", pencil=pencil, feedback=feedback)
    explorer = tmsopt.explore(replace(posed, model=model))
    explorer.save(tmp_path / "lag.html")
    with show(tmp_path / "lag.html") as page:
        found = page.evaluate("tmsopt.motion({lean: 2, push: 0.3, seconds: 2})")
        plain, impulse = equations(explorer, shown(page))
    A = np.zeros((5, 5))
    A[:4, :4] = plain
    A[2:4, 4] = impulse
    A[4, [2, 4]] = -gain / lag, -1 / lag
    truth = integrated(A, [np.radians(2), 0, *(0.3 * impulse), 0], found["t"])
    np.testing.assert_allclose([found["phi"], found["delta"]], truth[:, :2].T, atol=CLOSE * np.abs(truth[:, :2]).max())


def test_programs_cannot_set_what_is_impossible(show):
    with show("ep4") as page:
        before = shown(page)
        for wrong in ("{Froude: 1}", "{Fr: -1}", "{Fr: 'fast'}"):
            text = page.evaluate(f"(() => {{try {{tmsopt.set({wrong})}} catch (e) {{return e.message}}}})()")
            assert text.startswith(("no parameter Froude; there are: Fr", "Fr: "))
        assert shown(page) == before


def test_a_page_is_small_and_its_texts_are_whole():
    """What the documentation promises; and taking blanks out of a script takes none out of its texts."""
    html = tmsopt.explore(PROBLEMS / "whipple_ep4.toml").html
    assert len(html.encode()) < 150_000
    html += tmsopt.explore(PROBLEMS / "loss_only_dimer.toml").html
    for path in PAGE.glob("*.js"):
        code = re.sub(r"^\s*(//.*|/\*\*.*\*/|\*.*)$| // .*$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
        texts = re.findall(r'"(?:[^"\\\n]|\\.)*"', re.sub(r"`[^`]*`", "", code))
        assert [t for t in texts if t not in html] == [], path.name

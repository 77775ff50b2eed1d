"""The Riemann sheets of the page against eigenvalues of the matrices by NumPy."""

import numpy as np
import pytest
from helpers.browser import drawn
from helpers.javascript import said_by
from helpers.places import PROBLEMS

import tmsopt
from tmsopt.explorer import page_of

ASK = "(({xs, ys, sheets}) => [state.plane.map(symbolOf), [...xs], [...ys], sheets])(sheetsOf(state))"
SHADES = """() => {
  Object.assign(view, {turn: -90, tilt: 90});
  repaints.forEach((repaint) => repaint());
  return [...document.querySelectorAll("#sheets .picture canvas")].map((canvas) => {
    const {pixel} = boxIn(canvas.width, canvas.height);
    const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const read = (x, y) => `rgb(${data.slice(4 * (Math.round(y) * canvas.width + Math.round(x)), -1).slice(0, 3).join()})`;
    const middles = Array.from({length: 30}, (_, k) => (2 * k + 1) / 30 - 1);
    return middles.map((up) => middles.map((across) => pixel(across, up, 0)).map(({x, y}) => SHADES.indexOf(read(x, y))));
  });
}"""
"""Indices of the colours at the middles of all faces, seen from above."""


@pytest.mark.parametrize("name", ["loss_only_dimer", "bose_hubbard", "coupled_pair", "transport_aircraft"])
def test_they_are_the_eigenvalues_of_the_matrices(name):
    solution = tmsopt.solve(PROBLEMS / f"{name}.toml")
    plane, x, y, sheets = said_by(page_of(solution), ASK)
    over = tmsopt.sheets(solution, plane, grid=(len(x), len(y)))
    values = over.values
    assert np.allclose([x, y], over.grid)
    found = np.array(sheets).view(complex)[..., 0].reshape(2, *values.shape)
    near = 1e-10 * np.abs(values).max()
    for heights, expected in ((found[0].real, values.real), (found[1].imag, values.imag)):
        assert np.allclose(heights, np.sort(expected), rtol=0, atol=near)
    apart = np.abs(found[..., None] - values[:, :, None])
    assert max(apart.min(axis=-1).max(), apart.min(axis=-2).max()) <= near


@pytest.mark.slow
def test_colours_are_the_other_part_of_the_upper_sheet(show):
    """Between the lines of the grid, without the disc of the exceptional point."""
    values = tmsopt.sheets(PROBLEMS / "loss_only_dimer.toml", grid=(31, 31)).values
    with show("loss_only_dimer") as page:
        page.evaluate("drawDot = drawText = () => {}")
        found = np.array(page.evaluate(SHADES))
    for shades, height, other in zip(found, (values.real, values.imag), (values.imag, values.real), strict=True):
        top = np.take_along_axis(other, height.argmax(axis=2)[..., None], axis=2)[:-1, :-1, 0]
        room = 0.08 * np.ptp(other)
        expected = 64 * (top - other.min() + room) / (np.ptp(other) + 2 * room)
        assert np.mean(np.abs(shades - expected) <= 1) > 0.98
        assert len(np.unique(shades)) > 20


@pytest.mark.slow
def test_hands_and_keys_turn_both_pictures_and_nothing_else(show):
    pictures = "[...document.querySelectorAll('#sheets .picture canvas')].map((canvas) => canvas.toDataURL())"
    with show("loss_only_dimer") as page:
        canvas, before, link = page.locator("#sheets .picture canvas").last, page.evaluate(pictures), page.url
        assert "−0.6i (2-fold)" in canvas.get_attribute("aria-label")
        canvas.focus()
        for key in ("ArrowLeft", "ArrowLeft", "ArrowUp"):
            page.keyboard.press(key)
        assert page.evaluate("view") == {"turn": -50, "tilt": 25}
        canvas.scroll_into_view_if_needed()
        box = canvas.bounding_box()
        page.mouse.move(box["x"] + 50, box["y"] + 50)
        page.mouse.down()
        page.mouse.move(box["x"] + 70, box["y"] + 250)
        page.mouse.up()
        page.mouse.move(box["x"] + 90, box["y"] + 90)
        drawn(page)
        assert page.evaluate("view") == {"turn": -60, "tilt": 90}  # never seen from below
        assert not {*before} & {*page.evaluate(pictures)}
        assert (page.url, page.evaluate("steps.past")) == (link, [])

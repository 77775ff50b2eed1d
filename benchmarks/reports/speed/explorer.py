"""How large a page of the explorer is, how long it takes to write, and to draw in a browser without a window."""

import shutil
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import tmsopt
from benchmarks.reports.tables import Asked, duration, page, table
from benchmarks.suites import PROBLEMS

PAGES = ("ep4", "realistic", "point_mass_robot", "whipple_ep4", "coupled_pair", "two_mass_spring", "transport_aircraft")
SURVEY = """(wanted) => {
  const [i, j] = DATA.plane, {low, high} = DATA.parameters[i], {low: least, high: most} = DATA.parameters[j];
  const axis = (from, to) => Float64Array.from({length: 200}, (_, k) => from + (to - from) * k / 199), times = [];
  for (let k = 0; k < 15; k++) {
    const before = performance.now();
    survey(Float64Array.from(DATA.start), i, j, axis(low, high), axis(least, most), wanted);
    times.push(performance.now() - before);
  }
  return times.slice(5).sort((a, b) => a - b)[5] / 1000;
}"""
SLIDE = """async () => {
  const i = DATA.plane[0], {low, high} = DATA.parameters[i], times = [];
  const frame = () => new Promise(requestAnimationFrame);
  change({layer: "abscissa"});
  for (let k = 0; k < 45; k++) {
    change({x: [[i, low + (high - low) * (k + 1) / 47]]}, false);
    await frame(); await frame();
    times.push(window.measured.all);
  }
  return times.slice(5).sort((a, b) => a - b)[20] / 1000;
}"""


def report(asked: Asked) -> str:
    """The report in Markdown."""
    from playwright.sync_api import sync_playwright

    rows = []
    with TemporaryDirectory() as here, sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for name in PAGES[:2] if asked.quick else PAGES:
            solution, path = tmsopt.solve(PROBLEMS / f"{name}.toml", throw=False), Path(here) / f"{name}.html"
            began = time.perf_counter()
            tmsopt.explore(solution).save(path)
            written = time.perf_counter() - began
            shown = browser.new_page(viewport={"width": 1400, "height": 900})
            shown.goto(path.as_uri())
            drawn = (*(shown.evaluate(SURVEY, wanted) for wanted in ([], ["abscissa"])), shown.evaluate(SLIDE))
            rows.append((name, f"{path.stat().st_size / 1000:.0f} kB", *map(duration, (written, *drawn))))
        note = f"Medians, warm, in Chromium {browser.version} without a GPU; every picture is drawn in a step."
    header = ("page", "size", "written, the solve aside", "200 × 200 classes", "with abscissa", "step of a slider")
    return page("The explorer", asked, table(header, rows), note)

"""Charts to a folder: designs per second, and the memory of a large one."""

import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.reports.tables import Asked, page, table
from benchmarks.suites import PLANE
from tmsopt import Chart, chart

_SIZE = (2000, 1000)
_LAYERS: dict[str, dict[str, object]] = {"class alone": {"layers": ("kind",)}, "usual layers": {}}
_LARGE = (10_000, 10_000)


def charted(folder: str, points: tuple[int, int], **options: object) -> Chart:
    """A chart of the plane in a folder that is not there yet."""
    asked = {"folder": Path(folder) / "a.chart", "points": points, "boundaries": False, **options}
    return chart(PLANE, **asked)  # type: ignore[arg-type]


def rate(points: tuple[int, int], **options: object) -> float:
    """Designs per second of a whole chart, written to a folder that is deleted again, the best of two."""
    rates = []
    for _ in range(2):
        with tempfile.TemporaryDirectory() as folder:
            found = charted(folder, points, **options)
            rates.append(float(found.run["per_second"]))
    return max(rates)


def large(folder: str, points: tuple[int, int] = _LARGE) -> None:
    """A chart of many designs; prints seconds, the most memory in kB, and designs by eigenvalues."""
    found = charted(folder, points)
    peak = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    print(found.run["seconds"], peak.split()[1], found.counts.fallbacks)


def _said(points: tuple[int, int]) -> str:
    """A sentence on a large chart in a process of its own: how long it takes, and the most memory it has."""
    with tempfile.TemporaryDirectory() as folder:
        code = f"from benchmarks.reports.speed.folders import large; large({folder!r}, {points})"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        written = sum(f.stat().st_size for f in Path(folder).rglob("*") if f.is_file())
    seconds, peak, fallbacks = done.stdout.split()
    return (
        f"A chart of {points[0] * points[1]:.0e} designs ({points[0]} by {points[1]}, all usual layers, "
        f"{written / 1e6:.0f} MB) took {float(seconds):.0f} s in one process and "
        f"at most {int(peak) / 1024:.0f} MiB of resident memory; {fallbacks} designs needed companion eigenvalues."
    )


def report(asked: Asked) -> str:
    """Designs per second; unless quick, with a chart of 1e8 designs, 2 GB that are deleted again."""
    rows = []
    for name, layers in _LAYERS.items():
        for workers in (1, 2):
            points = (400, 200) if asked.quick else _SIZE
            rows.append(
                (f"{name}, {workers} worker{'s' * (workers > 1)}", f"{rate(points, workers=workers, **layers):.3g}")
            )
    return page(
        "Charts in tiles",
        asked,
        "Whole charts of `problems/chart.toml` with everything written to the disk, the best of two.",
        table(("chart", "designs per second"), rows),
        _said((1000, 1000) if asked.quick else _LARGE),
    )

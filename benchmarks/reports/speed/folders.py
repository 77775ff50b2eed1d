"""Charts to a folder: designs per second of the whole and of its parts, and the memory of a large one."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import click
import numpy as np

from benchmarks.reports.tables import keep, kept, origin
from tmsopt.charts.motion import classified
from tmsopt.charts.stored import TILE, store
from tmsopt.charts.survey import USUAL, Survey, survey
from tmsopt.design.files import load
from tmsopt.design.machine import engine_of

_FILE = "problems/chart.toml"
_SIZES = {"numpy": (2000, 1000), "numba": (4000, 2000)}
_ROUNDS = 5
_LAYERS = {"class alone": ("kind",), "usual layers": USUAL}


def parts(engine: str) -> dict[str, float]:
    """Seconds per design of the parts of a tile, the best of several interleaved rounds."""
    work = survey(load(_FILE, asks=False), points=_SIZES[engine], engine=engine)
    tiles = work.grid.tiles(TILE)
    rows = tiles[len(tiles) // 2]
    names = work.problem.model.coefficient_names()
    bare = replace(work, layers=("kind",))
    room = work.room(len(rows))
    a = list(room)

    def coefficients() -> None:
        values = bare.before(bare.grid.up(rows), engine)
        for array, name in zip(a, names, strict=True):
            array[...] = values[name]

    coefficients()
    ways: dict[str, Callable[[], object]] = {
        "coefficients": coefficients,
        "kernel, class": lambda: classified(a, {"kind"}, engine),
        "kernel, abscissa": lambda: classified(a, {"abscissa"}, engine),
        "tile, class alone": lambda: bare.tile(rows, room),
        "tile, usual layers": lambda: work.tile(rows, room),
    }
    best = dict.fromkeys(ways, np.inf)
    for _ in range(_ROUNDS + 1):  # the first one compiles
        for name, way in ways.items():
            start = time.perf_counter()
            way()
            best[name] = min(best[name], (time.perf_counter() - start) / a[0].size)
    return best


def stored(engine: str, layers: tuple[str, ...], workers: int) -> float:
    """Seconds per design of a whole chart, written to a folder that is deleted again, the best of two."""
    work: Survey = survey(load(_FILE, asks=False), points=_SIZES[engine], engine=engine, layers=layers)
    best = np.inf
    for _ in range(2):
        with tempfile.TemporaryDirectory() as folder:
            best = min(best, 1 / store(work, Path(folder) / "a.chart", workers=workers).run["per_second"])
    return float(best)


_LARGE = """
import sys, tempfile
from pathlib import Path
from tmsopt.design.files import load
from tmsopt.charts.stored import chart_to
with tempfile.TemporaryDirectory(dir=sys.argv[1]) as folder:
    found = chart_to(load(sys.argv[2], asks=False), Path(folder) / "a.chart", points=(10_000, 10_000))
    peak = next(line for line in open("/proc/self/status") if line.startswith("VmHWM"))
    print(found.run["engine"], found.run["seconds"], peak.split()[1], found.counts.fallbacks)
"""


def large(folder: Path) -> str:
    """A sentence on a chart of 1e8 designs in a process of its own: how long it takes, and the most memory it has."""
    command = [sys.executable, "-c", _LARGE, str(folder), _FILE]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    engine, seconds, peak = said[0], float(said[1]), int(said[2]) / 1024
    return (
        f"A chart of 1e8 designs (10 000 by 10 000, all usual layers, 1.9 GB) took {seconds:.0f} s with {engine} and "
        f"one worker, compilation included, and at most {peak:.0f} MiB of resident memory; {said[3]} designs needed "
        "companion eigenvalues."
    )


def section(command: str = "python -m benchmarks.tiles", quick: bool = False) -> str:
    """Designs per second in Markdown; unless quick, with a chart of 1e8 designs, 2 GB that are deleted again."""
    engines = [e for e in ("numpy", "numba") if e == "numpy" or engine_of("auto") == "numba"]
    found = {e: {n: 1 / t for n, t in parts(e).items()} for e in engines}
    for engine in engines:
        for name, layers in _LAYERS.items():
            for workers in (1, 2):
                rate = 1 / stored(engine, layers, workers)
                found[engine][f"chart to a folder, {name}, {workers} worker{'s' * (workers > 1)}"] = rate
    rows = [" | ".join([name, *(f"{found[e][name]:.3g}" for e in engines)]) for name in found["numpy"]]
    lines = [" | ".join(["designs per second", *engines]), " | ".join(["---"] * (1 + len(engines))), *rows]
    said = (
        f"Tiles of {TILE} designs of `{_FILE}`: first the parts of a tile alone, best of {_ROUNDS} interleaved rounds "
        "on one core, then whole charts with everything written to the disk."
    )
    table = "\n".join(f"| {line} |" for line in lines)
    texts = [
        "## Charts in tiles",
        origin(command),
        said,
        table,
        *([] if quick else [large(Path(tempfile.gettempdir()))]),
    ]
    return "\n\n".join(texts) + "\n"


@click.command()
@kept
@click.option("--quick", is_flag=True, help="without the chart of 1e8 designs")
def main(output: Path, quick: bool) -> None:
    """Measure and keep the table."""
    text = section(quick=quick)
    click.echo(text)
    keep(output, "tiles", text)


if __name__ == "__main__":
    main()

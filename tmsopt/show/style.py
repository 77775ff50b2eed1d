"""What all figures share: colours that the colour-blind can tell apart, sizes for print, and saving."""

import os
import tempfile
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

FORMATS = ("png", "pdf", "svg")
"""Endings of figure files."""

STABLE, HEAVY, LINE, MARK, CRITICAL = "#56B4E9", "#E69F00", "#000000", "#D55E00", "#0072B2"
"""Fills of stability and heavy damping, lines, marked points, the weave boundary (Okabe–Ito)."""

REAL, COMPLEX, CAPSIZE = "#009E73", "#CC79A7", "#999999"
"""Real and complex exceptional points, the capsize boundary."""


def new_figure(width: float, height: float) -> Figure:
    """An empty figure, sizes in inches, that needs no display."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure as a whole or not at all; the format is the ending of the name.

    Raises:
        OSError: when the file cannot be written.
    """
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".tmsopt-", suffix=path.suffix)
    os.close(handle)
    try:
        figure.savefig(temporary, dpi=200)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    finally:
        Path(temporary).unlink(missing_ok=True)

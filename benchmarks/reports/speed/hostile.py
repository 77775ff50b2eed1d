"""How long a file that means ill is read, and with how much memory, as it grows: each in a process of its own."""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.reports.tables import Asked, duration, page, table
from benchmarks.suites import PROBLEMS
from benchmarks.timing import exponent

EP4 = (PROBLEMS / "ep4.toml").read_text(encoding="utf-8")
OWN = '[model]\nname = "x"\ncoefficients = ["1", "q0"]\n[parameters]\nk = 1\n[model.quantities]\n'
HOSTILE = (
    ("blanks in a quoted header", "p.toml", 100_000, lambda n: EP4 + '["a' + " " * n + 'b"]\n'),
    ("unknown names", "p.toml", 9_000, lambda n: EP4 + "".join(f"b{i} = 1\n" for i in range(n))),
    ("a sum of terms", "p.toml", 150, lambda n: EP4.replace('"abscissa"', '"Fr' + "+Fr" * n + '"')),
    ("quantities", "p.toml", 120, lambda n: OWN + "".join(f'q{i} = "q{i + 1}"\n' for i in range(n)) + f'q{n} = "k"\n'),
    ("digits and a letter", "b.txt", 120_000, lambda n: "rF = " + "1" * n + "x\n"),
    ("rows, the last at fault", "rows.csv", 250_000, lambda n: "mu\n" + "0.1\n" * n + "x\n"),
)
READ = """import resource, sys, time, tmsopt, tmsopt.studies as studies
read = {"b.txt": tmsopt.read_bicycle, "rows.csv": studies.read_csv}.get(sys.argv[1], tmsopt.load)
warm, began = tmsopt.load(sys.argv[2]), time.process_time()
with __import__("contextlib").suppress(tmsopt.InputError): read(sys.argv[1])
print(time.process_time() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)"""


def report(asked: Asked) -> str:
    """The report in Markdown."""
    rows, factors = [], (1, 2) if asked.quick else (1, 2, 4)
    with TemporaryDirectory() as here:
        for name, file, size, text in HOSTILE:
            found, read = [], [sys.executable, "-c", READ, file, str(PROBLEMS / "ep4.toml")]
            for factor in factors:
                (Path(here) / file).write_text(text(factor * size), encoding="utf-8")
                found.append([*map(float, subprocess.check_output(read, cwd=here).split())])
            seconds, peaks = zip(*found, strict=True)
            growth = f"{exponent(factors, seconds):.1f}"
            rows.append((name, f"{size:,}", *map(duration, seconds), growth, round(max(peaks))))
    header = ("what there is much of", "as much", *(f"{factor} times" for factor in factors), "exponent", "MiB at most")
    return page("Hostile files", asked, table(header, rows))

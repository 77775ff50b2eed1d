"""The comparison of reports misses nothing that matters: a number, its unit, a verdict, a name."""

import pytest

from benchmarks.reports.facts import missing

BEFORE = "optimal: stable\n  x_B  39.911 cm\nroots: -5.9135 (4-fold); 0.55 s"
NAMES = frozenset({"x_B"})


@pytest.mark.parametrize(
    ("now", "lost"),
    [
        (BEFORE, []),
        ("the design is stable and optimal, x_B = 39.911 cm, root -5.9135, 4-fold; 9.99 s", []),
        (BEFORE.replace("39.911", "39.912"), ["39.911 cm"]),
        (BEFORE.replace("cm", "mm"), ["39.911 cm"]),
        (BEFORE.replace("stable", "fine"), ["stable"]),
        (BEFORE.replace("x_B", "x"), ["x_B"]),
        ("x_B cm\n39.911 optimal stable -5.9135 4", []),  # the unit may stand in a heading
    ],
)
def test_what_is_lost_is_named(now, lost):
    assert missing(BEFORE, now, NAMES) == lost

"""Remedies printed for infeasible problems, obeyed; the judge has exact roots beside multiple ones."""

import pytest

from benchmarks.reports.designs.remedies import obey
from benchmarks.suites.remedies import infeasible_files


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "robots 10",
        "bicycles 4",
    ],
)
def test_what_is_advised_leads_to_an_answer(name):
    """Robots 10: beside the smallest change there is no best design, for it improves towards a0 = 0."""
    file = next(file for file in infeasible_files(60) if file[0] == name)
    obeyed = obey(file)
    assert obeyed.status == "infeasible"
    assert not any(obeyed.remedies.values())

"""The comparison of the net: what counts as the same, and what does not."""

import copy
import json

import pytest

from benchmarks.suites.equivalence import CASES, compare, read_net

KNOWN = {"value": 2.0, "status": "optimal", "words": "decays in 2.0 s at 3.1", "structure": "EP4"}


@pytest.mark.parametrize(
    ("change", "same"),
    [
        ({}, True),
        ({"value": 2.0 * (1 + 1e-10)}, True),
        ({"value": 2.0 * (1 + 1e-8)}, False),
        ({"status": "infeasible"}, False),
        ({"words": "decays in 5.0 s at 3.1"}, True),  # a time that something took
        ({"words": "decays in 2.0 s at 3.2"}, False),
        ({"words": "grows in 2.0 s at 3.1"}, False),
        ({"more": 1}, False),
        ({"structure": None}, False),
    ],
)
def test_a_change_is_seen(change, same):
    assert (not compare("case", [KNOWN, KNOWN], KNOWN | change)) is same


def test_a_number_has_the_condition_that_the_runs_show():
    runs = [{"flat": 1.0}, {"flat": 1.0 + 1e-5}]
    assert not compare("case", runs, {"flat": 1.0 - 5e-5})
    assert compare("case", runs, {"flat": 1.01})


def test_the_doubles_of_a_multiple_root_may_scatter_and_its_value_may_not():
    known = {"roots": [{"re": -1.0, "multiplicity": 4}], "abscissa": -1.0, "abscissa_realised": -0.9996}
    assert not compare("case", [known], known | {"abscissa_realised": -0.9992})
    assert compare("case", [known], known | {"abscissa": -0.9999})


def test_words_that_the_runs_do_not_agree_on_are_not_compared():
    assert not compare("case", [{"note": "a"}, {"note": "b"}], {"note": "c"})


def test_every_case_is_in_the_net_and_is_the_same_as_itself():
    runs = read_net()
    assert [case.name for case in CASES] == list(runs[0])
    for name in ("solve/ep4", "text/ep4", "fault/ep4/0", "signatures/all", "fresh/00"):
        answers = [run[name] for run in runs]
        assert answers[0] != "no answer"
        assert not compare(name, answers, json.loads(json.dumps(answers[0])))
    changed = copy.deepcopy(runs[0]["solve/ep4"])
    changed["json"]["objective"]["value"] += 1e-6
    assert [d.path for d in compare("solve/ep4", [run["solve/ep4"] for run in runs], changed)] == [
        ".json.objective.value"
    ]

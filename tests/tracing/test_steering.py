"""Events of a user, and curves followed by hand, against closed forms."""

import json
import math

import numpy as np
import pytest

import tmsopt
from tmsopt import Event, InputError, Problem, laws
from tmsopt.models import from_coefficients

EP_SET = Problem(
    tmsopt.models.tms,
    fixed={"chi_H": 1.0, "zeta_B": -0.4, "zeta_H": -0.2, "mu": 0.1},
    free={"Fr": (0.5, 5.0), "chi_B": (1.01, 3.0), "lambda_s": (0.02, 1.48)},
    locate="2EP2",
)
FEW = {"starts": 2, "step": 0.02}
EXACT = 1e-12
"""Some roundings, times the slope of the curve."""

HALF = Event("half a radian", lambda p: p["lambda_s"] - 0.5)
FAST = Event("Fr is 3", lambda p: p["Fr"] - 3)


def law(angle):
    return float(laws.epset(-0.4, -0.2, angle))


def circle():
    """p(s) = (s + 2)² − (x² + y² − 1): a double root on the unit circle of x and y."""
    model = from_coefficients([1, 4, "5 - x**2 - y**2"])
    return Problem(model, free={"x": (-2.0, 2.0), "y": (-2.0, 2.0)}, locate="EP2")


def traced(*events):
    return tmsopt.trace(EP_SET, events=events, **FEW)


def by_name(found, name):
    return [e for e in found.events if e.name == name]


# Events in a trace


def test_an_event_is_located_to_rounding_and_is_a_point_of_its_branch():
    found = traced(HALF, FAST)
    (half,), fast, (branch,) = by_name(found, "half a radian"), by_name(found, "Fr is 3"), found.branches
    assert half.parameters["lambda_s"] == pytest.approx(0.5, abs=EXACT)
    assert half.parameters["Fr"] == pytest.approx(law(0.5), abs=EXACT)
    assert [e.parameters["Fr"] for e in fast] == pytest.approx([3.0, 3.0], abs=EXACT)
    for event in fast:
        assert law(event.parameters["lambda_s"]) == pytest.approx(3.0, abs=1e-11)
        assert branch.parameters["Fr"][event.index] == event.parameters["Fr"]
    assert [e.index for e in branch.events] == sorted(e.index for e in branch.events)


def test_events_of_the_package_stay_as_they_are():
    plain, more = traced(), traced(HALF)
    named = [[(e.name, e.detail, dict(e.parameters)) for e in t.events if e.name != HALF.name] for t in (plain, more)]
    assert named[0] == named[1]


def test_a_function_may_use_quantities_and_unknowns_of_the_pattern():
    """On the EP set c = √12.5 throughout (c² = 1/(ζ_B ζ_H)), so b² − 4c is 0 at EP4, where the abscissa is −√c."""
    square = Event("square", lambda p: p["b"] ** 2 - 4 * p["c"])
    slow = Event("slow", lambda p: p["abscissa"] + 1)
    found = traced(square, slow)
    (ep4,) = by_name(found, "EP4")
    (same,) = by_name(found, "square")
    assert same.index == ep4.index  # one place, both names
    for event in by_name(found, "slow"):
        assert found.branches[0].abscissa[event.index] == pytest.approx(-1, abs=1e-9)


def test_two_zeros_within_a_step_are_two_events():
    """lambda_s − 0.5 = ±1e-4, a fiftieth of a step."""
    near = Event("near", lambda p: (p["lambda_s"] - 0.5) ** 2 - 1e-8)
    angles = [e.parameters["lambda_s"] for e in by_name(tmsopt.trace(EP_SET, events=[near], starts=2), "near")]
    assert sorted(angles) == pytest.approx([0.5 - 1e-4, 0.5 + 1e-4], abs=1e-10)


def test_text_json_csv_and_pictures_have_them(tmp_path):
    noted = "on purpose, stability changes"  # which weave and capsize say of theirs; it decides nothing
    found = traced(Event("slow", HALF.function, detail=noted))
    assert by_name(found, "slow")[0].parameters["lambda_s"] == pytest.approx(0.5, abs=EXACT)
    assert "slow" in str(found)
    assert "on purpose" in str(found)
    data = json.loads(json.dumps(found.to_json()))
    assert ("slow", noted) in [(e["name"], e["detail"]) for e in data["branches"][0]["events"]]
    found.write_csv(tmp_path / "curve.csv")
    assert f"slow: {noted}" in (tmp_path / "curve.csv").read_text(encoding="utf-8")
    assert "slow" in [text.get_text() for text in found.plot().texts]


def test_an_event_that_stops_ends_a_branch_and_the_rest_is_another():
    whole = traced().branches[0]
    found = traced(Event("half", HALF.function, stop=True))
    assert len(found.branches) == 2
    assert sum(b.arclength[-1] for b in found.branches) == pytest.approx(whole.arclength[-1], abs=1e-4)
    for branch in found.branches:
        ends = [e.detail for e in branch.events if e.name == "end"]
        assert sorted(ends) == ["Fr.max", "half"]
        (half,) = [e for e in branch.events if e.name == "half"]
        assert half.index in (0, len(branch) - 1)
        assert half.parameters["lambda_s"] == pytest.approx(0.5, abs=EXACT)
    angles = [b.parameters["lambda_s"] for b in found.branches]
    assert all(np.all(a <= 0.5 + EXACT) or np.all(a >= 0.5 - EXACT) for a in angles)


@pytest.mark.parametrize("level", [0.3, -0.8])
def test_a_closed_curve_is_cut_where_it_stops(level):
    """The unit circle at x = level: two arcs, of angles that add up to 2π."""
    (whole,) = tmsopt.trace(circle(), **FEW).branches
    assert whole.closed
    found = tmsopt.trace(circle(), events=[Event("cut", lambda p: p["x"] - level, stop=True)], **FEW)
    assert len(found.branches) == 2
    assert not any(b.closed for b in found.branches)
    spans = [np.ptp(np.unwrap(np.arctan2(b.parameters["y"], b.parameters["x"]))) for b in found.branches]
    half = math.acos(level)
    assert sorted(spans) == pytest.approx(sorted([2 * half, 2 * math.pi - 2 * half]), abs=1e-10)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda p: p["Fr"] / 0, "raises ZeroDivisionError"),
        (lambda p: math.nan, "nan at Fr"),
        (lambda p: "fast", "'fast' at Fr"),
        (lambda p: None, "None at Fr"),
        (lambda p: p["Frr"], "did you mean 'Fr'"),
        (lambda p: p["Fr"] > 3, "(True|False) at Fr"),
    ],
)
def test_a_function_that_gives_no_number_is_named(function, words):
    with pytest.raises(InputError, match=words) as error:
        traced(Event("my own", function))
    (fault,) = error.value.faults
    assert fault.key == ("events", "my own")
    assert "Fr = " in fault.message  # where
    with pytest.raises(InputError, match="my own"):
        next(tmsopt.continue_from(EP_SET, events=[Event("my own", function)]))


@pytest.mark.parametrize(
    ("events", "words"),
    [
        (HALF, "events: found .*accepted: a list"),
        (["Fr - 3"], "events.0: found 'Fr - 3'; accepted: an Event"),
        ([HALF, Event("x", 3)], "events.1: found"),
        ([Event("two\nlines", HALF.function)], "events.0.name"),
        ([Event(3, HALF.function)], "events.0.name: found 3; accepted: a text"),
        *[([Event(n, HALF.function)], f"events.0.name: found '{n}'") for n in ("fold", "EP4", "2EP2", "end")],
    ],
)
def test_what_is_no_event_is_refused(events, words):
    for verb in (tmsopt.trace, tmsopt.continue_from):
        with pytest.raises(InputError, match=words):
            verb(EP_SET, events=events)


# By hand


def test_points_lie_on_the_curve_and_their_tangents_along_it():
    points = list(tmsopt.continue_from(EP_SET, step=0.02))
    assert len(points) > 20
    for point in points:
        assert point.parameters["Fr"] == pytest.approx(law(point.parameters["lambda_s"]), abs=EXACT)
    lengths = np.diff([p.arclength for p in points])
    assert points[0].arclength == 0
    assert np.all(lengths >= 0)
    for point in points:  # d Fr / d lambda_s of the law, by a difference
        angle, step = point.parameters["lambda_s"], 1e-6
        slope = (law(angle + step) - law(angle - step)) / (2 * step)
        assert point.tangent["Fr"] == pytest.approx(slope * point.tangent["lambda_s"], rel=1e-6, abs=1e-6)


def test_points_and_events_are_those_of_the_trace():
    (branch,) = traced(HALF).branches
    curve = tmsopt.continue_from(EP_SET, events=[HALF], step=0.02)
    named = {}
    for _ in range(2):
        named |= {name: p for p in curve for name in p.events}
        assert curve.end == "Fr.max"
        curve.reverse()
    assert set(named) == {"EP4", "fold", HALF.name}
    for event in (e for e in branch.events if e.name != "end"):
        assert dict(named[event.name].parameters) == pytest.approx(dict(event.parameters), abs=1e-9)


def test_a_consumer_stops_and_goes_on():
    curve = tmsopt.continue_from(EP_SET, through={"Fr": law(0.3), "chi_B": math.sqrt(2), "lambda_s": 0.3}, step=0.01)
    first = next(curve)
    assert first.parameters["lambda_s"] == pytest.approx(0.3, abs=0.05)
    if first.tangent["lambda_s"] < 0:
        curve.reverse()
    for point in curve:
        if point.parameters["lambda_s"] > 0.4:
            break
    after = next(curve)
    assert after.parameters["lambda_s"] > point.parameters["lambda_s"]
    assert curve.end == ""


def test_reverse_goes_back_over_the_same_curve():
    curve = tmsopt.continue_from(EP_SET, step=0.02, events=[FAST])
    ahead = [next(curve) for _ in range(10)]
    curve.reverse()
    back = next(curve)
    assert back.arclength < ahead[-1].arclength
    for name in ("Fr", "lambda_s"):
        assert back.tangent[name] * ahead[-1].tangent[name] < 0
    behind = [p.arclength for p in curve]
    assert np.all(np.diff(behind) <= 0)
    assert behind[-1] < 0  # beyond the first point
    curve.reverse()
    assert sum("Fr is 3" in p.events for p in curve) == 2  # the whole curve: on both sides of its least Fr


def test_turning_round_at_an_event_does_not_find_it_again():
    curve = tmsopt.continue_from(EP_SET, events=[FAST], step=0.02)
    for point in curve:
        if "Fr is 3" in point.events:
            break
    curve.reverse()
    least = min(p.parameters["Fr"] for p, _ in zip(curve, range(5), strict=False) if "Fr is 3" not in p.events)
    assert least < 3
    assert "Fr is 3" in next(p for p in curve if not {*p.events} <= {"EP4", "fold"}).events


def test_an_event_that_stops_is_the_last_point_and_one_can_turn_round():
    curve = tmsopt.continue_from(EP_SET, events=[Event("Fr is 3", FAST.function, stop=True)], step=0.02)
    ahead = list(curve)
    assert curve.end == "Fr is 3"
    assert ahead[-1].events == ("Fr is 3",)
    assert ahead[-1].parameters["Fr"] == pytest.approx(3, abs=EXACT)
    assert next(curve, None) is None
    curve.reverse()
    back = list(curve)
    assert curve.end == "Fr is 3"
    assert back[-1].parameters["Fr"] == pytest.approx(3, abs=EXACT)
    assert max(p.parameters["Fr"] for p in [*ahead, *back]) <= 3 + EXACT


def test_a_closed_curve_ends_where_it_began():
    curve = tmsopt.continue_from(circle(), step=0.02)
    points = list(curve)
    assert curve.end == "closed"
    assert dict(points[-1].parameters) == dict(points[0].parameters)
    assert points[-1].arclength == pytest.approx(2 * math.pi / 4, abs=1e-3)  # in widths of the box, which is 4


def test_a_solution_is_where_it_begins():
    problem = Problem(EP_SET.model, fixed=EP_SET.fixed, free=EP_SET.free, locate="EP4")
    solution = tmsopt.solve(problem)
    first = next(tmsopt.continue_from(solution, "2EP2"))
    for name in EP_SET.free:
        assert first.parameters[name] == pytest.approx(solution.parameters[name], abs=1e-9)


def test_where_nothing_is_found_is_said():
    empty = Problem(EP_SET.model, fixed=EP_SET.fixed, free={**EP_SET.free, "Fr": (0.5, 0.6)}, locate="2EP2")
    with pytest.raises(InputError, match="no point of 2EP2 found in the box"):
        tmsopt.continue_from(empty)
    with pytest.raises(InputError, match="through: found Fr; accepted: each of"):
        tmsopt.continue_from(EP_SET, through={"Fr": 3.0})
    with pytest.raises(InputError, match="step: found 5"):
        tmsopt.continue_from(EP_SET, step=5)

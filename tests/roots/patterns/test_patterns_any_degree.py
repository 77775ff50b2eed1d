"""Names, signs and marks of patterns beyond degree 4, for polynomials built with these patterns."""

import pytest

from tmsopt.roots import pattern, product


@pytest.mark.parametrize(
    ("written", "degree", "name"),
    [
        ("EP2+EP3", 7, "EP3+EP2"),
        ("CEP2 + EP2", 6, "EP2+CEP2"),
        ("EP2+EP2", 5, "2EP2"),
        ("EP2+2EP2", 6, "3EP2"),
        ("weave+CEP2+EP3", 9, "EP3+CEP2+weave"),
    ],
)
def test_each_pattern_has_one_name(written, degree, name):
    """Real roots first, the highest multiplicity first, each kind once."""
    assert pattern(written, degree).name == name
    assert pattern(written, degree) is pattern(written, degree)


@pytest.mark.parametrize(
    ("name", "quadratic", "belongs"),
    [
        ("CEP2", [2.0, 5.0], True),  # −1 ± 2i
        ("CEP2", [5.0, 4.0], False),  # −1 and −4
        ("2EP2", [5.0, 4.0], True),
        ("2EP2", [2.0, 5.0], False),
        ("2EP3", [5.0, 4.0], True),
        ("CEP3", [5.0, 4.0], False),
        ("weave", [3.0], True),  # ±i√3
        ("weave", [-3.0], False),
    ],
)
def test_pairs_and_two_real_roots_are_told_apart_by_a_sign(name, quadratic, belongs):
    form = pattern(name, 7)
    u = quadratic + [1.0] * (len(form.unknowns) - len(quadratic))
    assert all(x >= 0 for x in form.nonnegative(u)) is belongs


@pytest.mark.parametrize(
    ("name", "degree", "mark", "tied", "rest", "beside"),
    [
        ("CEP2", 6, "EP4", [2.0, 1.0], [[1, 3, 7]], [2.0, 2.0]),  # (s + 1)⁴
        ("CEP2", 6, "capsize", [2.0, 5.0], [[1, 0], [1, 3]], None),
        ("CEP2", 6, "EP2+CEP2", [2.0, 5.0], [[1, 3], [1, 3]], None),
        ("EP2", 5, "EP3", [-1.0], [[1, 1], [1, 2, 2]], [-1.5]),
        ("EP2", 5, "2EP2", [-1.0], [[1, 2], [1, 2], [1, 5]], None),
        ("EP3", 5, "3-fold zero", [0.0], [[1, 2, 3]], [-0.5]),
        ("EP3+EP2", 6, "EP5", [-2.0, -2.0], [[1, 3]], [-2.0, -1.0]),
        ("capsize", 5, "double zero", [], [[1, 0], [1, 1], [1, 2, 2]], None),
    ],
)
def test_marks_vanish_where_more_roots_meet(name, degree, mark, tied, rest, beside):
    """The functions are not 0 for other tied roots, or for the rest (s + 4)(s + 6)(s + 8) …"""
    form = pattern(name, degree)
    others = product(*rest)[1:]
    assert form.marks[mark]([*tied, *others]) == 0
    apart = product(*[[1, 4 + 2 * k] for k in range(len(others))])[1:]
    assert form.marks[mark]([*tied, *apart] if beside is None else [*beside, *others]) != 0

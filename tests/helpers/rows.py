"""Rows of a study for tests of its store, also in processes that load nothing else."""

from collections.abc import Mapping
from contextlib import AbstractContextManager

import pytest
from helpers.places import PROBLEMS

from tmsopt.errors import InputError
from tmsopt.problem import load
from tmsopt.records import Table
from tmsopt.studies import Row, Study, view_store

STUDY = Study(load(PROBLEMS / "ep4.toml"), {"mu": [0.1 + 1e-6 * n for n in range(100_000)]}, seed=7)


def row(number, study=STUDY, **given):
    """A row with what its study gives it."""
    varied = study.varied(number)
    told = {"status": "optimal", "abscissa": -1 / (1 + number)} | given
    if told["status"] not in ("failed", "quarantined"):
        given = {**study.problem.fixed, **varied}
        told = {"parameters": Table({n: given.get(n, 1.0) for n in study.problem.posed.parameter_set.names})} | told
    return Row(number, study.seed_of(number), varied, **told)


def faults(call, *given, **options):
    """What is wrong with a call, or with the context that it returns."""
    with pytest.raises(InputError) as caught:
        _enter(call(*given, **options))
    return str(caught.value)


def _enter(found):
    if isinstance(found, AbstractContextManager):
        found.__enter__()


def numbers_in(store):
    """The numbers of all rows of a store."""
    return [number for batch in store.read_batches() for number in batch["number"].tolist()]


def stored(path):
    """Numbers of the rows that a store has, which may not be made yet."""
    try:
        with view_store(path) as store:
            return set(numbers_in(store))
    except InputError:
        return set()


def flat(row):
    """All that a row says, but how long it took and where."""
    found = {}
    for name, value in row.to_json().items():
        some = {f"{name}.{key}": x for key, x in value.items()} if isinstance(value, Mapping) else {name: value}
        found |= some if name not in ("seconds", "host") else {}
    return found


def assert_same(rows, others):
    """The same rows in any order: texts are equal, numbers to 1e-9 of their size; laws are rounding errors."""
    pairs = zip(*(sorted(some, key=lambda row: row.number) for some in (rows, others)), strict=True)
    for one, other in (map(flat, pair) for pair in pairs):
        assert list(one) == list(other)
        for name, value in one.items():
            if value != other[name]:
                assert value == pytest.approx(other[name], rel=1e-9, abs=1e-12), (name, one["number"])

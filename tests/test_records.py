"""Records as plain data: what a number, a table, an array and a record inside become."""

import json
import math
from dataclasses import dataclass

import numpy as np

from tmsopt.records import Column, Table, plain


@dataclass(frozen=True)
class Inner:
    re: float
    pair: tuple[float, complex]


@dataclass(frozen=True)
class Outer:
    name: str
    inner: Inner
    table: Table[float]
    values: np.ndarray
    absent: Inner | None = None

    @property
    def size(self):
        return np.float64(len(self.values))


@dataclass(frozen=True)
class Said:
    seconds: float

    def to_json(self):
        return {"time": self.seconds}


OUTER = Outer("x", Inner(-math.inf, (1 / 3, 2 + 1j / 3)), Table({"b": math.nan, "a": 2.0}), np.array([1.0, np.inf]))


def test_fields_stand_in_their_order_and_what_is_not_finite_is_none():
    assert json.dumps(plain(OUTER), allow_nan=False) == json.dumps(
        {
            "name": "x",
            "inner": {"re": None, "pair": [1 / 3, {"re": 2.0, "im": 1 / 3}]},
            "table": {"b": None, "a": 2.0},
            "values": [1.0, None],
            "absent": None,
        }
    )


def test_names_choose_attributes_and_their_order():
    assert list(plain(OUTER, "size name").items()) == [("size", 2.0), ("name", "x")]


def test_digits_reach_the_numbers_inside():
    assert plain(OUTER, "inner", digits=3) == {"inner": {"re": None, "pair": [0.333, {"re": 2.0, "im": 0.333}]}}


def test_a_record_inside_is_written_as_it_says():
    assert plain(
        {"said": Said(1.0), "flags": (True, None), "column": Column([1, math.nan]), "truth": np.bool_(True)}
    ) == {
        "said": {"time": 1.0},
        "flags": [True, None],
        "column": [1.0, None],
        "truth": True,
    }

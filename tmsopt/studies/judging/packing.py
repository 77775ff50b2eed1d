"""A block of rows as bytes: a line of JSON, and the columns as little-endian doubles."""

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from tmsopt.disk import from_json
from tmsopt.studies.judging.block import NUMBERS, RowBlock, Shared

_LONGEST = 1_000_000  # characters of the line
_TABLES = ("varied.", "violation.", "law.", "report.")


def packed_block(block: RowBlock) -> bytes:
    """All of a block."""
    head = {
        "shared": asdict(block.shared), "columns": list(block.columns), "rows": len(block), "seconds": block.seconds,
        "host": block.host,
    }  # fmt: skip
    arrays = [block.numbers.astype("<i8"), *(column.astype("<f8") for column in block.columns.values())]
    return b"".join([json.dumps(head).encode(), b"\n", *(array.tobytes() for array in arrays)])


def unpacked_block(data: bytes) -> RowBlock:
    """What `packed_block` was given.

    Raises:
        ValueError: for bytes that it did not make.
    """
    line, found, rest = data.partition(b"\n")
    head = from_json(line.decode(), _LONGEST)
    if not found or not isinstance(head, dict) or set(head) != {"shared", "columns", "rows", "seconds", "host"}:
        raise ValueError("it begins with no such line")
    names, count = _names(head["columns"]), head["rows"]
    if type(count) is not int or count < 1 or len(rest) != 8 * count * (1 + len(names)):
        raise ValueError(f"no {count!r:.20} rows")
    numbers = np.frombuffer(rest, "<i8", count).astype(np.int64)
    whole = np.frombuffer(rest, "<f8", offset=8 * count).reshape(len(names), count).astype(float)
    truths = np.isin(whole[names.index("oscillates")], (0, 1)).all()
    if np.any(np.diff(numbers) <= 0) or numbers[0] < 0 or not truths:
        raise ValueError("its rows are in no order")
    if not isinstance(head["host"], str) or type(head["seconds"]) is not float:
        raise ValueError("seconds or host")
    columns = dict(zip(names, whole, strict=True))
    return RowBlock(_shared(head["shared"], names), numbers, columns, head["seconds"], head["host"])


def _names(found: Any) -> list[str]:
    texts = isinstance(found, list) and all(isinstance(name, str) for name in found)
    if not texts or len(set(found)) < len(found) or not set(NUMBERS) <= set(found):
        raise ValueError("names of columns")
    if any(name not in NUMBERS and not name.startswith(_TABLES) for name in found):
        raise ValueError("a column of another kind")
    return list(found)


def _shared(found: Any, names: list[str]) -> Shared:
    limits = {name.removeprefix("violation.") for name in names if name.startswith("violation.")}
    try:
        seed, fixed, units, of_abscissa = (found[k] for k in ("seed", "fixed", "units", "of_abscissa"))
        made = Shared(
            seed, {n: float(x) for n, x in fixed.items()}, {n: (text, float(one)) for n, (text, one) in units.items()},
            tuple(of_abscissa),
        )  # fmt: skip
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(f"what its rows share ({error})") from error
    known = all(isinstance(text, str) and one for text, one in made.units.values())
    if type(seed) is not int or seed < 0 or not known or not limits <= set(made.units) >= set(made.of_abscissa):
        raise ValueError("what its rows share")
    return made

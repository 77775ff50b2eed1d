"""Rows that solve nothing, thousands at once: judged in blocks, kept as columns, made into rows when asked for.

In: a study in which nothing is free. Out: `RowBlock`, columns of rows; `RowsInBlocks`, these and single
rows in one order. Open `judging` first.
"""

from tmsopt.studies.judging import table
from tmsopt.studies.judging.block import RowBlock
from tmsopt.studies.judging.judging import applies, judged, judged_alone, shared_by
from tmsopt.studies.judging.packing import packed_block, unpacked_block
from tmsopt.studies.judging.rows import RowsInBlocks, gathered

__all__ = [
    "RowBlock",
    "RowsInBlocks",
    "applies",
    "gathered",
    "judged",
    "judged_alone",
    "packed_block",
    "shared_by",
    "table",
    "unpacked_block",
]  # fmt: skip

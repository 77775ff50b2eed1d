"""Rows that solve nothing, thousands at once: judged in blocks, kept as columns, made into rows when asked for.

In: a study in which nothing is free. Out: `Block`, columns of rows; `Rows`, blocks and single rows in one order. Open
`judging` first.
"""

from tmsopt.studies.judging import table
from tmsopt.studies.judging.block import Block
from tmsopt.studies.judging.judging import applies, frame_of, judged, judged_alone
from tmsopt.studies.judging.packing import packed_block, unpacked_block
from tmsopt.studies.judging.rows import Rows, gathered

__all__ = [
    "Block", "Rows", "applies", "frame_of", "gathered", "judged", "judged_alone", "packed_block", "table", "unpacked_block",
]  # fmt: skip

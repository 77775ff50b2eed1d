"""Results as text for a reader; nothing is computed here.

In: results of any verb. Out: lines of text. Open `design` first: the report of a solution.
"""

from tmsopt.report.curves import chart_table, trace_table
from tmsopt.report.design import solution_table
from tmsopt.report.explanation import (
    diagnosis_lines,
    explained_lines,
    meaning_lines,
    optimality_lines,
    robustness_line,
    robustness_table,
)
from tmsopt.report.ledger import ledger_page, ledger_table
from tmsopt.report.proof import proof_text
from tmsopt.report.speeds import speeds_table

__all__ = [
    "chart_table",
    "diagnosis_lines",
    "explained_lines",
    "ledger_page",
    "ledger_table",
    "meaning_lines",
    "optimality_lines",
    "proof_text",
    "robustness_line",
    "robustness_table",
    "solution_table",
    "speeds_table",
    "trace_table",
]

"""Results as text for a reader; nothing is computed here.

In: results of any verb. Out: lines of text. Open `design` first: the report of a solution.
"""

from tmsopt.report.comparison import comparison_table
from tmsopt.report.curves import chart_table, front_table, trace_table
from tmsopt.report.design import every_table, si_parameters, solution_table
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
from tmsopt.report.study import row_lines, study_table

__all__ = [
    "chart_table", "comparison_table", "diagnosis_lines", "every_table", "explained_lines", "front_table",
    "ledger_page", "ledger_table", "meaning_lines", "optimality_lines", "proof_text", "robustness_line",
    "robustness_table", "row_lines", "si_parameters", "solution_table", "speeds_table", "study_table",
    "trace_table",
]  # fmt: skip

from .comparison import comparison_table as comparison_table
from .curves import (
    branch_table as branch_table, chart_table as chart_table, corner_rows as corner_rows, domain_table as domain_table,
    event_rows as event_rows, front_rows as front_rows, front_table as front_table,
    swallowtail_table as swallowtail_table, trace_table as trace_table,
)
from .every import every_table as every_table
from .ledger import ledger_page as ledger_page, ledger_table as ledger_table
from .motion import motion_table as motion_table
from .proof import number_rows as number_rows, proof_text as proof_text
from .solution import (
    design_parts as design_parts, design_report as design_report, lever_cells as lever_cells,
    parameter_rows as parameter_rows, quantity_rows as quantity_rows, si_parameters as si_parameters,
    structure_line as structure_line,
    diagnosis_lines as diagnosis_lines,
    explained_lines as explained_lines, nearest_table as nearest_table, optimality_lines as optimality_lines,
    robustness_line as robustness_line, robustness_table as robustness_table, Findings as Findings,
    findings as findings,
    infeasible_lines as infeasible_lines,
    rounding_line as rounding_line,
)
from .speeds import growth_table as growth_table, speeds_table as speeds_table
from .study import row_lines as row_lines, study_rows as study_rows, study_table as study_table

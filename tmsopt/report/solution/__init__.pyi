from .design import (
    design_parts as design_parts, design_report as design_report, lever_cells as lever_cells,
    si_parameters as si_parameters,
)
from .explanation import (
    diagnosis_lines as diagnosis_lines, explained_lines as explained_lines, optimality_lines as optimality_lines,
    rounding_line as rounding_line,
)
from .findings import Findings as Findings, findings as findings
from .infeasible import infeasible_lines as infeasible_lines
from .robustness import (
    nearest_table as nearest_table, robustness_line as robustness_line, robustness_table as robustness_table,
)
from .rows import parameter_rows as parameter_rows, quantity_rows as quantity_rows, structure_line as structure_line

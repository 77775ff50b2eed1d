from .bound import omega0_bound as omega0_bound, relation_bound as relation_bound
from .columns import can_evaluate_columns as can_evaluate_columns, evaluate_columns as evaluate_columns
from .law_rows import LAWS as LAWS, law_rows as law_rows
from .recheck import realised_abscissa as realised_abscissa, recheck as recheck
from .stored import abscissa_as_stored as abscissa_as_stored, missed_note as missed_note
from .worst_case import prove_worst_case as prove_worst_case, find_worst_cases as find_worst_cases

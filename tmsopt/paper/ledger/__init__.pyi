from .claims import compute_entry as compute_entry, select_claims as select_claims, verify as verify
from .entry import (
    VERDICTS as VERDICTS, Entry as Entry, Ledger as Ledger, judge_decimal as judge_decimal,
    judge_identity as judge_identity, judge_statement as judge_statement,
)
from .language import compute as compute, list_definitions as list_definitions, read_tables as read_tables

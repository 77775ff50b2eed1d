from .blocks import (
    Badge as Badge, Cell as Cell, Chapter as Chapter, Document as Document, Figure as Figure, Listing as Listing,
    Sentence as Sentence, TableBlock as TableBlock, Verbatim as Verbatim,
)
from .curves import list_events as list_events
from .design_rows import convert_to_si as convert_to_si
from .explanation import describe_rounding as describe_rounding
from .paper import write_ledger_page as write_ledger_page
from .proofs import list_numbers as list_numbers
from .results import (
    MODULE_BY_CLASS as MODULE_BY_CLASS, analyse as analyse, document_of as document_of, draw as draw,
    to_notebook as to_notebook, headline as headline, picture_of as picture_of, plot as plot, report as report,
    response as response, save_report as save_report,
)
from .robustness import describe_robustness as describe_robustness
from .studies import describe_row as describe_row
from .text import to_headline as to_headline, to_text as to_text, wrap as wrap

from .blocks import (
    Badge as Badge, Cell as Cell, Chapter as Chapter, Document as Document, Figure as Figure, Listing as Listing,
    Sentence as Sentence, TableBlock as TableBlock, Verbatim as Verbatim,
)
from .curves import event_rows as event_rows
from .design_rows import si_parameters as si_parameters
from .explanation import rounding_line as rounding_line
from .paper import ledger_page as ledger_page
from .proofs import number_rows as number_rows
from .results import (
    HOME as HOME, analyse as analyse, document_of as document_of, draw as draw, fragment as fragment,
    headline as headline, maker_of as maker_of, plot as plot, report as report, response as response, save_report as save_report,
)
from .robustness import robustness_line as robustness_line
from .studies import row_sentence as row_sentence
from .text import to_headline as to_headline, to_text as to_text

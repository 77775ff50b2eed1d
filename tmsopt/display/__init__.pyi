from .document import save_report as save_report
from .page import page as page
from .writers import (
    WRITERS as WRITERS, drawn as drawn, headline as headline, plotted as plotted, report as report,
    response as response,
)

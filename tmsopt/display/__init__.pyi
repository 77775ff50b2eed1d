from .page import page as page
from .writers import WRITERS as WRITERS, drawn as drawn, headline as headline, report as report

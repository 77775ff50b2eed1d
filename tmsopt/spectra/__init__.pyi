from .loop import Cycle as Cycle, EnclosedPoint as EnclosedPoint, Loop as Loop, encircle as encircle
from .sheets import Sheets as Sheets, sheets as sheets

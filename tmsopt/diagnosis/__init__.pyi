from .diagnosis import Diagnosis as Diagnosis, diagnose as diagnose, diagnosed as diagnosed
from .jordan import is_regular as is_regular, jordan as jordan
from .puiseux import branches as branches
from .splitting import Response as Response

from .diagnosis import Diagnosis as Diagnosis, diagnose as diagnose, diagnosed as diagnosed
from .puiseux import branches as branches
from .splitting import Response as Response

from .factorisation import Factorisation as Factorisation, abscissa_formula as abscissa_formula
from .proof import Proof as Proof, prove as prove, prove_design as prove_design
from .certify import certify as certify, check_installed as check_installed

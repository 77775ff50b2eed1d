from .branch import Branch as Branch, BranchPoint as BranchPoint, EventPoint as EventPoint, Trace as Trace
from .continuation import (
    CurvePoint as CurvePoint, End as End, both_ways as both_ways, curve as curve, follow as follow,
    tangent_at as tangent_at, walk as walk,
)
from .domain import Domain as Domain, domain as domain
from .events import Event as Event
from .steering import Continuation as Continuation, continue_from as continue_from
from .swallowtail import Swallowtail as Swallowtail, swallowtail as swallowtail
from .trace import trace as trace

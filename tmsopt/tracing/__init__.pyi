from .branch import Branch as Branch, BranchPoint as BranchPoint, EventPoint as EventPoint, Trace as Trace
from .continuation import (
    CurvePoint as CurvePoint, End as End, compile_curve as compile_curve, compute_tangent as compute_tangent,
    follow as follow, walk as walk, walk_both_ways as walk_both_ways,
)
from .domain import Domain as Domain, domain as domain
from .events import Event as Event
from .steering import Continuation as Continuation, continue_from as continue_from
from .swallowtail import Swallowtail as Swallowtail, swallowtail as swallowtail
from .trace import trace as trace

from .branch import Branch as Branch, Event as Event, Trace as Trace
from .continuation import (
    End as End, between as between, both_ways as both_ways, contains as contains, curve as curve, same as same,
    tangent_at as tangent_at, walk as walk,
)
from .domain import Domain as Domain, domain as domain
from .solving import crossing as crossing, project as project
from .swallowtail import Swallowtail as Swallowtail, swallowtail as swallowtail
from .trace import trace as trace

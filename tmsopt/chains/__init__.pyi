from .discriminant import Discriminant as Discriminant, find_discriminant as find_discriminant
from .family import Family as Family, family_of as family_of
from .meetings import (
    all_meetings as all_meetings, has_regular_lead as has_regular_lead, is_crossing as is_crossing,
    located_meetings as located_meetings, meetings as meetings, nearest_crossing as nearest_crossing,
)
from .points import (
    Axis as Axis, ExceptionalPoint as ExceptionalPoint, Target as Target, find_point as find_point,
    measure_point as measure_point, raise_order as raise_order,
    refine as refine, refine_near as refine_near, targets_of as targets_of,
)

from .stability import MultipleRoot as MultipleRoot, describe_crossing as describe_crossing, stability as stability
from .status import describe_status as describe_status, describe_verdict as describe_verdict

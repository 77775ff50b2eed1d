from .meetings import located_meetings as located_meetings, meetings as meetings
from .stability import MultipleRoot as MultipleRoot, crossing_in_words as crossing_in_words, stability as stability
from .status import status_in_words as status_in_words, verdict_in_words as verdict_in_words

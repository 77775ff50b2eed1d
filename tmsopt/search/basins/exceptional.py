"""Where to start from beside a sample: designs with one root, or one pair, of full multiplicity."""

from itertools import zip_longest

from tmsopt.models.user_spectrum import full_patterns
from tmsopt.problem.freedom import degrees_of_freedom
from tmsopt.program.formulate import matching
from tmsopt.program.ipopt import ipopt
from tmsopt.program.starts import initial_point
from tmsopt.search.multistart import HOPELESS_AFAR, candidate_of, distinct
from tmsopt.search.workspace import LocalEnd, Workspace

_LEADS = 3  # designs with one root, and with one pair, that are started from
_LEADLESS = 8  # starts in a row that led to no other, after which no more are tried


def exceptional(work: Workspace) -> list[dict[str, float]]:
    """Designs with one root, or one pair, of full multiplicity: those of least abscissa, where enough is free for them.

    The least abscissa is often at one, and where a0 may vanish it may stand in so thin a needle that no sample sees it,
    while equations lead there.
    """
    part, sampler, sample, degree = work.part, work.sampler, work.sample, work.part.model.degree
    limits = {name: text for name, text in part.constraints.items() if name not in part.asked_of_roots}
    found: list[LocalEnd] = []
    if sampler is None or sample is None or degree == 1:
        return []
    most = HOPELESS_AFAR if sample.far_off else _LEADLESS
    for pattern in full_patterns(part.model):
        asked = part.derive(locate=pattern, minimize="abscissa", maximize=None, constraints=limits)
        asked = asked.derive(scenarios={}, tolerances={})
        if degrees_of_freedom(asked).count < 0:
            continue
        leading = matching(asked)
        lead, leads, last = ipopt(leading, work.options), list[LocalEnd](), 0
        turns = zip_longest(*([(seen, k) for k in range(len(seen))] for seen in (sample.boldest, sample.refined)))
        starts = (sampler.design(seen, k) for seen, k in (turn for pair in turns for turn in pair if turn))
        for count, design in enumerate(starts, 1):
            if new := distinct([candidate_of(asked, leading, lead(initial_point(leading, asked, design)))], leads):
                leads, last = leads + new, count
            idle = count - last >= (_LEADLESS if leads else most)
            if idle or (count >= most and sample.refined.out_of_reach(degree)):
                break
        found += distinct(leads, found)[:_LEADS]
    return [work.design_at(c.run.x) for c in found]

"""Taylor integration right through the contact changes, for motion of which only they are wanted.

One set of equations serves all contact states, which are runtime parameters; a callback switches
them where a gap passes zero, so that heyoka's own loop runs on. Nothing is done for each leg but
to note how it ended.
"""

from functools import lru_cache
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from squeal.model.equations import term_count
from squeal.model.law import ContactLaw
from squeal.simulation.integrators import symbols
from squeal.simulation.integrators.pool import Pool

# Up to this tolerance sums are taken in their own order: regrouped by the compiler their rounding
# drifts, which a hundred scenes' energy shows, and else the step is a third cheaper.
FINE = 1e-14
MOST_STEPS = 5000  # at a time; bounds the list of changes


class Changes(NamedTuple):
    """Changes of contact: each with its point and time, and the states (n, 6) then."""

    points: tuple[int, ...]
    times: tuple[float, ...]
    states: np.ndarray


class Through:
    """The integrator of a law at a tolerance; its compiled code serves every pad."""

    def __init__(self, law: ContactLaw, tolerance: float, terms: tuple[str, ...]) -> None:
        on = symbols.state_parameters(law)
        system, heights, limits = symbols.equations(law, on, terms)
        self._log: list[tuple[int, float, bytes]] = []
        upwards, downwards = hy.event_direction.positive, hy.event_direction.negative
        # No cooldown: once the state has changed, the same gap passes zero in the other sense.
        events = [
            hy.t_event(e, direction=upwards, callback=self._on_change(point), cooldown=0.0)
            for point, e in enumerate(symbols.rising(heights, on))
        ] + [hy.t_event(limit, direction=downwards) for limit in limits]
        self.ta = hy.taylor_adaptive(
            system,
            [0.0] * 6,
            pars=[1.0] * (len(symbols.NAMES) + law.points + term_count(terms)),
            tol=tolerance,
            t_events=events,
            compact_mode=law.points > symbols.OWN_CODE,
            fast_math=tolerance > FINE,
        )
        self._pars, self._state = self.ta.pars, self.ta.state

    # heyoka copies callbacks deeply, which leaves functions and what they refer to shared
    def _on_change(self, point: int) -> Any:
        row, log = len(symbols.NAMES) + point, self._log

        def switch(ta: Any, _sign: int) -> bool:
            self._pars[row] = 1.0 - self._pars[row]
            log.append((point, ta.time, self._state.tobytes()))
            return True

        return switch

    def run(
        self, pars: np.ndarray, t: float, state: np.ndarray, stop: float, most: int
    ) -> tuple[Changes, tuple[Any, ...]]:
        """From (t, state) to `stop`, to a limit or for at most so many steps.

        pars: all runtime parameters. Returns the changes and what heyoka says of the end.
        """
        ta, log = self.ta, self._log
        log.clear()
        self._pars[:] = pars
        self._state[:] = state
        ta.time = t
        ta.reset_cooldowns()
        last = ta.propagate_until(stop, max_steps=most)
        points, times, states = zip(*log, strict=True) if log else ((), (), ())
        return Changes(points, times, np.frombuffer(b"".join(states)).reshape(-1, 6)), last


@lru_cache(maxsize=32)
def through(law: ContactLaw, tolerance: float, terms: tuple[str, ...]) -> Pool[Through]:
    """The integrators of a law and a tolerance."""
    return Pool(lambda: Through(law, tolerance, terms))

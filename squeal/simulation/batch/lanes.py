"""Many pads at once in the lanes of the processor: all take a step, each its own, at every call."""

import mmap
import os
import tempfile
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from squeal.errors import ComputationError
from squeal.model.law import ContactLaw
from squeal.simulation.batch.motion import Course
from squeal.simulation.batch.step import (
    LEFT,
    LONG,
    LONGEST,
    SAMPLED,
    STEPS,
    TIME,
    TOUCHING,
    WIDTH,
    compiled_samples,
    compiled_step,
    order_of,
)
from squeal.simulation.integrators.pool import Pool

WIDE = 1000  # pads on their way at once: calls from Python count little, arrays stay in the cache
LOOK = 8  # most steps in one call, after which it is looked how many lanes are idle
CALL = 256  # steps of all pads in one call, beside which what the call itself costs is little
IDLE = 0.125  # share of the lanes that may wait for others
MOST_STEPS = 1_000_000  # of a pad
AT_ONCE, MOST_AT_ONCE = 50_000, 1_000  # steps, of all pads and of one, kept before they are read
_EPS = float(np.finfo(float).eps)


class Lanes:
    """Steps of a law at a tolerance; the compiled code serves every pad.

    `terms` are those with velocities, see `PadModel.terms`.
    """

    def __init__(self, law: ContactLaw, tolerance: float, terms: tuple[str, ...] = ()) -> None:
        self.points = law.points
        self._of = law, order_of(max(tolerance, _EPS)), terms
        self._in_turn = False

    @cached_property
    def step(self) -> Any:
        """See `compiled_step`."""
        return compiled_step(*self._of)

    @cached_property
    def samples(self) -> Any:
        """See `compiled_samples`."""
        return compiled_samples(*self._of)

    def check(self, rows: np.ndarray, pars: np.ndarray, each: np.ndarray) -> None:
        """Raise ComputationError unless steps in one call are those of calls of their own.

        Looks at the first call alone. `rows` (inputs, n) are what the first of them was given,
        `each` (steps, inputs + 1, n) what was made.
        """
        if self._in_turn:
            return
        pars = pars[:, : rows.shape[1]].copy()
        for made in each:
            alone = self.step(rows, pars=pars, batch_parallel=False)
            if not np.array_equal(made, alone, equal_nan=True):
                raise ComputationError(
                    "this version of heyoka does not work through columns in turn, which many "
                    "motions at once rest on: install the one that squeal names"
                )
            rows = alone[:-1]
        self._in_turn = True

    def run(
        self,
        coefficients: np.ndarray,
        touching: np.ndarray,
        state: np.ndarray,
        stop: np.ndarray,
        samples: np.ndarray,
        terms: np.ndarray,
    ) -> Course:
        """Integrate n pads: coefficients (len(NAMES), n), touching (points, n) of 0 or 1, state
        (6, n), samples (n,): how many of each, terms (m, n): the numbers of terms with velocities.

        The first pads are begun first: the long motions had better be among them.
        """
        given = np.zeros((TOUCHING + self.points, len(stop)))
        given[:6], given[LEFT], given[LONGEST], given[TOUCHING:] = state, stop, LONG, touching
        run = _Run(self, given, np.concatenate([coefficients, terms]), samples)
        while run.refill():
            run.go()
        return run.course(touching, stop)


def twice(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Two arrays (size,) in one memory: what is written to one is read from the other."""
    handle = os.memfd_create("steps") if hasattr(os, "memfd_create") else None
    with tempfile.TemporaryFile() if handle is None else os.fdopen(handle, "w+b") as file:
        file.truncate(8 * size)
        one, other = (np.frombuffer(mmap.mmap(file.fileno(), 8 * size)) for _ in range(2))
    return one, other


class _Run:
    """Pads on their way, a column each of the rows of a step, and what is kept of all pads.

    Lanes without a pad hold one more that has no time left.
    """

    def __init__(
        self, lanes: Lanes, given: np.ndarray, pars: np.ndarray, samples: np.ndarray
    ) -> None:
        self._lanes, self._count, self._begun = lanes, given.shape[1], 0
        self._last = np.concatenate([given, given[:, -1:]], axis=1)
        self._last[LEFT, -1] = 0.0
        self._pars = np.concatenate([pars, pars[:, -1:]], axis=1)
        self._ids = np.empty(0, dtype=int)
        self._now = np.empty((len(given), 0))
        self._room = np.empty((AT_ONCE + (LOOK + 1) * (WIDE + WIDTH)) * (len(given) + 1))
        self._read, self._written = twice(2 * (CALL + WIDE + WIDTH) * (len(given) + 2))
        self._limit = np.full(self._count + 1, -1)
        # pads, codes and times of the changes of contact, and with samples all rows of the input
        self._changes = [(np.empty(0, dtype=int), np.empty(0), np.empty(0))]
        self._states_then = [np.empty((len(given), 0))]
        self._first = np.concatenate([[0], np.cumsum(samples)])
        self._states = np.repeat(given[:6].T, samples, axis=0)
        # time between the samples of each pad
        self._apart = None
        if samples.any():
            self._apart = np.append(
                np.where(given[LEFT] > 0.0, given[LEFT], 1.0) / (samples - 1), 1.0
            )

    def refill(self) -> bool:
        """Let go of the pads that are done and begin others; False if none are left."""
        self._last[:, self._ids] = self._now
        going = self._ids[self._now[LEFT] > 0.0]
        new = np.arange(self._begun, min(self._count, self._begun + WIDE - len(going)))
        self._begun += len(new)
        ids = np.concatenate([going, new])
        self._ids = np.append(ids, np.full(-len(ids) % WIDTH, self._count))
        self._now = self._last.take(self._ids, axis=1)
        return ids.size > 0

    def go(self) -> None:
        """Take steps until some lanes are idle and others can take their place, or all are done."""
        step, ids, inputs = self._lanes.step, self._ids, len(self._now)
        share = 1.0 - IDLE if self._begun < self._count else 0.5
        enough = 1 if len(ids) == WIDTH else share * len(ids)
        # Columns are worked through in turn. Those of each step are written where those of the
        # next are read, which takes two addresses, since heyoka refuses arrays that overlap. One
        # step alone would write each row where the row below is still to be read.
        steps = min(LOOK, max(2, CALL // len(ids)))
        size = steps * len(ids)
        given = self._read[: inputs * size].reshape(inputs, size)
        made = self._written[len(ids) :][: (inputs + 1) * size].reshape(inputs + 1, size)
        each = made.reshape(inputs + 1, steps, -1).swapaxes(0, 1)
        pars = np.tile(self._pars[: step.nparams].take(ids, axis=1), steps)
        most = max(1, min(MOST_AT_ONCE, AT_ONCE // len(ids)) // steps) * steps
        # of each step the output, whose first rows are the next one's input
        rows = self._room[: (most + 1) * (inputs + 1) * len(ids)]
        rows = rows.reshape(most + 1, inputs + 1, len(ids))
        rows[0, :inputs] = self._now
        done = 0
        while done < most and (not done or np.count_nonzero(rows[done, LEFT]) >= enough):
            given[:, : len(ids)] = rows[done, :inputs]
            step(given, pars=pars, outputs=made, batch_parallel=False)
            self._lanes.check(rows[done, :inputs], pars, each)
            rows[done + 1 : done + 1 + steps] = each
            done += steps
        rows = rows[: done + 1]
        self._note(rows)
        if self._apart is not None:
            self._sample(rows)
        self._now = rows[-1, :inputs].copy()
        self._now[LEFT, self._now[STEPS] > MOST_STEPS] = -1.0

    def _note(self, rows: np.ndarray) -> None:
        step, lane = rows[1:, -1].nonzero()
        code, pads = rows[step + 1, -1, lane], self._ids[lane]
        ended = code < 0.0
        self._limit[pads[ended]] = -1.0 - code[ended]
        changed = ~ended
        then = step[changed] + 1, lane[changed]
        self._changes.append((pads[changed], code[changed], rows[then[0], TIME, then[1]]))
        if self._apart is not None:
            self._states_then.append(rows[then[0], :-1, then[1]].T)

    def _sample(self, rows: np.ndarray) -> None:
        assert self._apart is not None
        ids, function = np.tile(self._ids, len(rows) - 1), self._lanes.samples
        # how many samples there are up to the begin and the end of each step
        t = rows[:, TIME]
        reached = (t / self._apart[self._ids] + 1e-9).astype(int) + 1
        begun, done = reached[:-1].ravel(), reached[1:].ravel()
        calls = -(-(done - begun) // SAMPLED)
        steps = np.repeat(np.arange(len(ids)), calls)
        number = begun[steps] + SAMPLED * (
            np.arange(len(steps)) - np.repeat(np.cumsum(calls) - calls, calls)
        )
        idle = -len(steps) % WIDTH
        steps = np.append(steps, np.zeros(idle, int))
        number = np.append(number, done[:1].repeat(idle))
        which, lane = np.divmod(steps, len(self._ids))
        pads, flat, at = ids[steps], rows.ravel(), which * rows[0].size + lane
        given = np.empty((8 + self._lanes.points, len(steps)))
        touching = range(TOUCHING, TOUCHING + self._lanes.points)
        for place, row in zip(given, (*range(6), *touching), strict=False):
            place[:] = flat.take(at + row * len(self._ids))
        given[-1] = self._apart[pads]
        given[-2] = number * given[-1] - flat.take(at + TIME * len(self._ids))
        out = np.empty((6 * SAMPLED, len(steps)))
        pars = self._pars[: function.nparams].take(pads, axis=1)
        function(given, pars=pars, outputs=out, batch_parallel=False)
        at = self._first[pads] + number
        for i in range(SAMPLED):
            some = (number + i < done[steps]).nonzero()[0]
            self._states[at[some] + i] = out[6 * i : 6 * (i + 1)].take(some, axis=1).T

    def course(self, touching: np.ndarray, stop: np.ndarray) -> Course:
        """What the motions were."""
        last, limit = self._last[:, :-1], self._limit[:-1]
        lane, code, t = (np.concatenate(p) for p in zip(*self._changes, strict=True))
        order = np.argsort(lane.astype(np.min_scalar_type(self._count)), kind="stable")
        then = np.concatenate(self._states_then, axis=1)
        then = then[:, order] if then.size else then
        return Course(
            first=self._first,
            states=self._states,
            stop=stop,
            touching=touching,
            end=last[:6],
            lane=lane[order],
            point=code[order].astype(int) - 1,
            t=t[order],
            on=then[TOUCHING:].astype(int),
            state=then[:6],
            steps=last[STEPS].astype(int),
            limit=limit,
            limit_t=np.where(limit < 0, np.nan, last[TIME]),
            whole=(last[LEFT] == 0.0) & np.isfinite(last[:6]).all(axis=0),
        )


@lru_cache(maxsize=32)
def lanes(law: ContactLaw, tolerance: float, terms: tuple[str, ...] = ()) -> Pool[Lanes]:
    """The integrators of a law and a tolerance; one serves all pads of a thread in turn."""
    return Pool(lambda: Lanes(law, tolerance, terms))

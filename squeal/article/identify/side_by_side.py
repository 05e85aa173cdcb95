"""Taylor integration with heyoka of many motions side by side."""

from typing import Any

import numpy as np

from squeal.simulation.hybrid import DenseOutput, Limit, Segment
from squeal.simulation.taylor import (
    Machine,
    Record,
    TaylorIntegrator,
    limit_of,
    parameters_of,
    segment_of,
)

LANES = 8  # motions side by side
MOST_STEPS = 1_000_000  # of a motion; one that needs more is given up


class TaylorBatch(TaylorIntegrator):
    """Integrator over many scaled pads whose numbers are arrays (n,), some at a time side by side.

    It resolves no changes of several points in one instant.
    """

    def run(
        self, contact: np.ndarray, t: Any, state: np.ndarray, stop: Any, dense: bool
    ) -> Segment:
        """Integrate n motions (a multiple of `LANES`) in their contact (points, n).

        Each goes from its time `t` (n,) and state (6, n) to `stop` (n,), or to an earlier limit of
        `MOST_STEPS`; `dense` keeps the whole path.
        """
        machine = self.compiled(LANES)
        parameters = parameters_of(self._model, np.asarray(contact))
        n = parameters.shape[1]
        t0 = np.array(t, dtype=float)
        t1 = np.array(stop, dtype=float)
        end = np.array(state, dtype=float)
        count = np.zeros(n, dtype=int)
        limit = np.full(n, Limit.NONE)
        parts = []
        for offset in range(0, n, LANES):
            motions = slice(offset, offset + LANES)
            machine.first_motion = offset
            machine.start(parameters[:, motions], end[:, motions], t0[motions])
            record = Record(machine) if dense else None
            # slices are views: it writes into them where each motion ended
            self._carry(
                machine, record, t1[motions], end[:, motions], count[motions], limit[motions]
            )
            if record is not None:
                parts.append(record.smooth(offset))
        smooth = None
        if dense:
            smooth = DenseOutput(
                *(np.concatenate(arrays, axis=-1) for arrays in zip(*parts, strict=True))
            )
        # the machine's log holds the contact changes of all blocks
        return segment_of(
            machine,
            parameters,
            t0=t0,
            t1=t1,
            first=np.asarray(contact),
            end=end,
            count=count,
            limit=limit,
            smooth=smooth,
        )

    def _carry(
        self,
        machine: Machine,
        record: Record | None,
        t: np.ndarray,
        state: np.ndarray,
        count: np.ndarray,
        limit: np.ndarray,
    ) -> None:
        """Carry motions side by side from where the machine stands to their ends.

        t (lanes,): the ends, which become where each motion stops; state (6, lanes), count, limit
        (lanes,): are filled.
        """
        points = self._model.law.points
        how = record.options() if record is not None else {}
        parameters = machine.pars.copy()
        start = machine.state.copy()
        until = t.copy()
        while True:
            machine.ta.propagate_until(until, max_steps=MOST_STEPS, **how)
            results = machine.ta.propagate_res
            count += [result[3] for result in results]
            stopped_by = np.array([limit_of(result[0], points) for result in results])
            going = limit == Limit.NONE
            t[:] = machine.ta.time
            state[:, going] = machine.state[:, going]
            stopped = (t < until) & (stopped_by != Limit.NONE)
            limit[stopped] = stopped_by[stopped]
            if not stopped.any():
                break
            # a motion that ends at a limit waits at its start while the others go on
            until[stopped] = t[stopped]
            machine.pars[:, stopped] = parameters[:, stopped]
            machine.state[:, stopped] = start[:, stopped]
            machine.ta.reset_cooldowns()
        limit[t < until] = Limit.FAILED

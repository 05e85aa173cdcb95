"""Motions of many pads, some at a time side by side, in heyoka's batch mode."""

from collections.abc import Callable

import heyoka as hy
import numpy as np

from squeal.model.pad import Coefficients
from squeal.simulation.hybrid import DenseOutput, Limit, Segment
from squeal.simulation.taylor import (
    NAMES,
    Adaptive,
    Code,
    ContactChange,
    HeyokaIntegrator,
    Machine,
    Record,
    dense_output,
    limit_of,
    runtime_parameters,
)

LANES = 8  # motions side by side
MOST_STEPS = 1_000_000  # of a motion; one that needs more is given up


class BatchMachine(Machine):
    """A compiled integrator of `LANES` motions side by side, of which the first has the number
    `first_motion`."""

    adaptive = staticmethod(hy.taylor_adaptive_batch)
    event = staticmethod(hy.t_event_batch)
    motions = (LANES,)

    def __init__(self, code: Code) -> None:
        super().__init__(code)
        self.first_motion = 0

    def contact_callback(self, point: int) -> Callable[..., bool]:
        """The callback that flips the contact of a point in a lane."""

        def in_a_lane(ta: Adaptive, _sign: int, lane: int) -> bool:
            """Flip the contact and log the change; the motion goes on."""
            self.flip(point, lane)
            motion = self.first_motion + lane
            state = self.columns[lane].tobytes()
            self.log.append(ContactChange(motion, point, ta.time.item(lane), state))
            return True

        return in_a_lane

    def set_time(self, t: np.ndarray) -> None:
        self.ta.set_time(t)


class TaylorBatch(HeyokaIntegrator):
    """Integrator over many scaled pads whose numbers are arrays (n,), some at a time side by side.

    It resolves no changes of several points in one instant.
    """

    machine = BatchMachine

    def run(
        self, contact: np.ndarray, t: np.ndarray, state: np.ndarray, stop: np.ndarray, dense: bool
    ) -> Segment:
        """Integrate n motions (a multiple of `LANES`), `LANES` of them side by side.

        Each goes from its time `t` (n,), state (6, n) and contact (points, n) to `stop` (n,), or to
        an earlier `Limit`, as where a spring collapses; `dense` keeps the whole path.
        """
        machine = self.ready()
        assert isinstance(machine, BatchMachine)
        parameters = runtime_parameters(self.model, np.asarray(contact))
        n = parameters.shape[1]
        t0 = np.array(t, dtype=float)
        t1 = np.array(stop, dtype=float)
        end = np.array(state, dtype=float)
        count = np.zeros(n, dtype=int)
        limit = np.full(n, Limit.NONE)
        parts: list[DenseOutput | None] = []  # of each motion, with `dense`
        for offset in range(0, n, LANES):
            motions = slice(offset, offset + LANES)
            machine.first_motion = offset  # with the lane it numbers the motion of a contact change
            machine.start(parameters[:, motions], end[:, motions], t0[motions])
            record = Record(machine, dense)
            # slices are views: it writes into them where each motion ended
            self._carry(
                machine, record, t1[motions], end[:, motions], count[motions], limit[motions]
            )
            if dense:
                times = np.array(record.times)  # (s + 1, lanes)
                series = np.array(record.series)  # (s, 6, p, lanes)
                for lane in range(LANES):
                    output_of_lane = dense_output(times[:, lane], series[..., lane], offset + lane)
                    parts.append(output_of_lane)
        return Segment(
            law=self.model.law,
            c=Coefficients(*parameters[: len(NAMES)]),
            t0=t0,
            t1=t1,
            first_contact=np.asarray(contact),
            end=end,
            changes=machine.changes(),  # of all blocks
            step_count=count,
            limit=limit,
            dense_output=DenseOutput.joined(parts),
        )

    def _carry(
        self,
        machine: Machine,
        record: Record,
        t: np.ndarray,
        state: np.ndarray,
        count: np.ndarray,
        limit: np.ndarray,
    ) -> None:
        """Carry motions side by side from where the machine stands to their ends.

        heyoka stops the whole batch as soon as one motion meets a limit; it is then started again
        for the motions that have not met one.

        All arguments are changed. t (lanes,): the requested ends, which become the times at which
        motions stop; state (6, lanes), count, limit (lanes,): of each motion at its end.
        """
        points = self.model.law.points
        recording = record.options()
        parameters = machine.pars.copy()
        start = machine.state.copy()
        until = t.copy()
        while True:
            machine.ta.propagate_until(until, max_steps=MOST_STEPS, **recording)
            # of each motion the outcome, its shortest and longest step, and how many steps
            outcomes, _, _, steps = zip(*machine.ta.propagate_res, strict=True)
            count += np.array(steps)
            stopped_by = np.array([limit_of(outcome, points) for outcome in outcomes])
            not_stopped_before = limit == Limit.NONE
            t[:] = machine.ta.time
            # in the lane of a motion that stopped earlier the machine holds its first state
            state[:, not_stopped_before] = machine.state[:, not_stopped_before]
            stopped = (t < until) & (stopped_by != Limit.NONE)
            limit[stopped] = stopped_by[stopped]
            if not stopped.any():
                break
            # the others go on; a stopped motion has no time left, and is put back to its first
            # state and contact, which are within all limits: else it would stop the batch at once
            until[stopped] = t[stopped]
            machine.pars[:, stopped] = parameters[:, stopped]
            machine.state[:, stopped] = start[:, stopped]
            machine.ta.reset_cooldowns()
        # neither a limit nor the end was reached in the allowed number of steps
        limit[t < until] = Limit.FAILED

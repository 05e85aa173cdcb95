"""What is zero where stability is lost, with its exact derivatives by place and parameters."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from squeal.analysis.maps import Axis
from squeal.analysis.sensitivity import Change, change
from squeal.equilibrium.damping import damped_model
from squeal.equilibrium.statics import Statics
from squeal.io.scene import Scene
from squeal.linear import complex_eigenvalues, sensitivities
from squeal.model.equations import PadModel
from squeal.model.linear import linearise
from squeal.model.states import State
from squeal.numerics.newton import complex_step

Kind = Literal["flutter", "divergence", "fold", "contact"]
GROWS = 1e-6  # of the spectral radius: a real part that another mode may not have on the curve


@dataclass(frozen=True)
class Threshold:
    """A kind of threshold near a contact state: unknowns z = (q over the pad's units, u), u (2,)
    the place in the map from 0 to 1 on each axis. B3 has no unknown q."""

    scene: Scene
    axes: tuple[Axis, Axis]
    kind: Kind
    state: State
    point: int  # the contact point that changes, of the kind "contact"
    omega: float  # rad/s of the pair that starts to grow, with damping

    @property
    def linear(self) -> bool:
        return self.scene.pad_model.linear

    @cached_property
    def size(self) -> np.ndarray:
        """Units of q (3,)."""
        length = 1.0 if self.linear else Statics.of(self.scene.pad_model).units.length
        return np.array([length, length, length / self.scene.pad.w])

    def parameters(self, u: np.ndarray) -> np.ndarray:
        """Both parameters at u (2,)."""
        return np.array([axis.at(share) for axis, share in zip(self.axes, u, strict=True)])

    def model(self, u: np.ndarray) -> PadModel:
        """The pad at u (2,), damped as the scene says. Raises InputError out of its range."""
        names = (axis.name for axis in self.axes)
        values = dict(zip(names, self.parameters(u).tolist(), strict=True))
        return damped_model(self.scene.replace(**values))

    def split(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """q (3,) in SI units and u (2,)."""
        return (np.zeros(3), z) if self.linear else (z[:3] * self.size, z[3:])

    def conditions(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Balance and threshold (1 or 4,), and their derivative by z."""
        q, u = self.split(z)
        model = self.model(u)
        ways = [self._by(model, q, i, u) for i in range(2)]
        if not self.linear:
            name = self.axes[0].name
            moves = self.size * np.eye(3)
            ways = [change(model, q, self.state, name, moved=move) for move in moves] + ways
        value, slope = self._threshold(model, q, ways)
        if self.linear:
            return np.array([value]), slope[None, :]
        K = -model.jacobian(q, self.state)
        force = 1.0 / (self.size * np.abs(K).max(axis=0)).max()
        scale = force * np.array([1.0, 1.0, 1.0 / self.scene.pad.w])
        by_u = np.array([way.loads for way in ways[3:]]).T
        rows = scale[:, None] * np.hstack([-K * self.size, by_u])
        loads = scale * model.loads(q, self.state)
        return np.append(loads, value), np.vstack([rows, slope])

    def _by(self, model: PadModel, q: np.ndarray, i: int, u: np.ndarray) -> Change:
        """Derivatives by one entry of u with q held."""
        axis = self.axes[i]
        found = change(model, q, self.state, axis.name, held=True)
        low, high = axis.ends
        rate = (high - low) * (axis.at(u[i]) * math.log(10.0) if axis.log else 1.0)
        found = Change(*(rate * part for part in vars(found).values()))
        damping = self.scene.damping
        if damping is None or damping.matrix is not None:
            return found
        # ratios refer to the pad at hand: what they do to C is a difference, all else is exact
        step = 1e-6 * np.eye(2)[i]
        up, down = (linearise(self.model(u + way), q, self.state).C for way in (step, -step))
        return replace(found, C=found.C + (up - down) / 2e-6)

    def _threshold(
        self, model: PadModel, q: np.ndarray, ways: list[Change]
    ) -> tuple[float, np.ndarray]:
        """What is zero on the curve, of order one, and its derivative along each way."""
        if self.kind == "contact":
            height = self.size[0]
            gap = float(model.gaps(q)[self.point]) / height
            return gap, np.array([way.gaps[self.point] for way in ways]) / height
        m = linearise(model, q, self.state)
        if self.kind == "flutter" and m.C.any():
            spectrum = complex_eigenvalues(*m)
            k = self._pair(spectrum.values)
            rates = [
                sensitivities(*m, dM=w.M, dC=w.C, dK=w.K, spectrum=spectrum)[k].real for w in ways
            ]
            return float(spectrum.values[k].real) / self.omega, np.array(rates) / self.omega
        A = np.linalg.solve(m.M, m.K)
        lever = np.array([1.0, 1.0, self.scene.pad.w])
        A = lever[:, None] * A / lever
        size = float(np.linalg.norm(A, 2))
        changes = [
            lever[:, None] * np.linalg.solve(m.M, w.K - w.M @ np.linalg.solve(m.M, m.K)) / lever
            for w in ways
        ]
        of = _discriminant if self.kind == "flutter" else _determinant

        stack = np.array(changes).transpose(1, 2, 0) / size
        slope = complex_step(of, A[..., None] / size + 0.0 * stack, along=stack)
        return float(of((A / size)[..., None])[0]), slope

    def _pair(self, values: np.ndarray) -> int:
        """Which of the eigenvalues (m,) is that of the pair that starts to grow, with damping."""
        near = np.where(values.imag > 0.0, values.imag, np.inf)
        return int(np.argmin(np.abs(near - self.omega) + np.abs(values.real)))

    def quiet(self, z: np.ndarray) -> bool:
        """True if the contact is that of the gaps, no other mode grows, and stability is lost."""
        q, u = self.split(z)
        model = self.model(u)
        if not self.linear:
            side = np.where(list(self.state), 1.0, -1.0) * model.gaps(q)
            side[self.point if self.kind == "contact" else slice(0)] = -1.0
            if np.any(side > 1e-9 * self.size[0]):
                return False
        if self.kind == "contact" and not self._lost(model, q):
            return False
        return float(self._others(model, q).max(initial=0.0)) < GROWS

    def _lost(self, model: PadModel, q: np.ndarray) -> bool:
        """True if a mode grows once the contact has changed, or the branch turns back there."""
        beyond = linearise(model, q, self.state.flip(self.point))
        values = complex_eigenvalues(*beyond).values
        before = np.linalg.det(linearise(model, q, self.state).K)
        turns = bool(before * np.linalg.det(beyond.K) < 0.0)
        return turns or float(values.real.max()) > GROWS * float(np.abs(values).max())

    def _others(self, model: PadModel, q: np.ndarray) -> np.ndarray:
        """Real parts over the spectral radius of the modes that are not at their threshold."""
        m = linearise(model, q, self.state)
        values = complex_eigenvalues(*m).values
        size = np.abs(values).max()
        if self.kind == "contact":
            return np.asarray(values.real / size)
        if self.kind == "flutter":
            at = self.frequency(model, q)
            near = np.argsort(np.abs(np.abs(values.imag) - at) + np.abs(values.real))
            return np.asarray(values.real[near[2 if m.C.any() else 4 :]] / size)
        return np.asarray(values.real[np.argsort(np.abs(values))[2:]] / size)

    def frequency(self, model: PadModel, q: np.ndarray) -> float:
        """Of the mode that starts to grow, rad/s."""
        if self.kind != "flutter":
            return 0.0
        m = linearise(model, q, self.state)
        if m.C.any():
            values = complex_eigenvalues(*m).values
            return float(values.imag[self._pair(values)])
        s = np.linalg.eigvals(np.linalg.solve(m.M, m.K))
        pairs = [(abs(s[i] - s[j]), (s[i] + s[j]).real / 2) for i, j in ((0, 1), (0, 2), (1, 2))]
        return math.sqrt(max(min(pairs)[1], 0.0))


def _determinant(A: np.ndarray) -> np.ndarray:
    return np.asarray(np.sum(A[0] * np.cross(A[1], A[2], axis=0), axis=0))


def _discriminant(A: np.ndarray) -> np.ndarray:
    """Discriminant (n,) of the characteristic polynomial of A (3, 3, n), real or complex."""
    b = -(A[0, 0] + A[1, 1] + A[2, 2])
    pairs = ((0, 1), (0, 2), (1, 2))
    c = sum(A[i, i] * A[j, j] - A[i, j] * A[j, i] for i, j in pairs)
    d = -_determinant(A)
    found = 18 * b * c * d - 4 * b**3 * d + b**2 * c**2 - 4 * c**3 - 27 * d**2
    return np.asarray(found)

"""Models B1 and B2 with damped contact, written out once more from the article's equations.

SI units, NumPy alone, nothing of squeal. Each contact point bears k p max(0, 1 + a p'). States are
(6, n): x, y, theta and their rates, of n motions side by side, each with its own numbers.
"""

import numpy as np
import yaml
from scipy.integrate import solve_ivp
from scipy.optimize import root

from tests.conftest import ROOT

SIZES = np.array([1e-5, 1e-5, 2.5e-4])  # of x, y and theta
GAUSS = (-1.0 / np.sqrt(3.0), 1.0 / np.sqrt(3.0))


class Pad:
    """A case with contact damping a (s/m), modal damping ratio zeta and friction mu.

    a, zeta and mu are numbers or arrays (n,), one a motion.
    """

    def __init__(self, name, a, zeta, mu=None, mean=False):
        scene = yaml.safe_load((ROOT / f"workflow/scenes/{name}.yaml").read_text(encoding="utf-8"))
        p = {"y0": 0.0} | scene["parameters"]
        for angle in ("alpha1", "alpha2"):
            p[angle] = float(str(p[angle]).removesuffix("*pi")) * np.pi
        self.points = scene["model"] == "B1"
        self.mean = mean
        self.p = p
        self.mass = np.array([p["m"], p["m"], p["I"]])
        stiffness = p["k3"] + p["k4"] if self.points else p["k_c"]
        self.compression = p["F_n"] / stiffness
        # the modal damping matrix at zeta = 1, about rest without friction
        self.a = np.zeros(())
        self.zeta = np.zeros(())
        self.mu = np.zeros(())
        self.unit = np.zeros((3, 3))
        roots = np.sqrt(self.mass)
        K = -self.slopes(self.rest())[:, :3]
        values, modes = np.linalg.eigh(0.5 * (K + K.T) / np.outer(roots, roots))
        self.unit = 2.0 * (modes * np.sqrt(values)) @ modes.T * np.outer(roots, roots)
        self.a = np.asarray(a, dtype=float)
        self.zeta = np.asarray(zeta, dtype=float)
        self.mu = np.asarray(p["mu"] if mu is None else mu, dtype=float)

    def edges(self, z):
        """Gaps (2, ...) of the leading and trailing edges and their rates."""
        p = self.p
        theta = z[2]
        drop_l = p["h"] * np.cos(theta) + p["w"] * np.sin(theta)
        drop_t = p["h"] * np.cos(theta) - p["w"] * np.sin(theta)
        side_l = p["h"] * np.sin(theta) - p["w"] * np.cos(theta)
        side_t = p["h"] * np.sin(theta) + p["w"] * np.cos(theta)
        height = (p["y0"] if not self.points else 0.0) + z[1] + p["h"]
        gaps = np.array([height - drop_l, height - drop_t])
        rates = np.array([z[4] + side_l * z[5], z[4] + side_t * z[5]])
        return gaps, rates, np.array([side_l, side_t]), np.array([drop_l, drop_t])

    def loads(self, z):
        """Loads (3, ...) and the normal force."""
        p = self.p
        theta = z[2]
        force = np.zeros((2, *np.shape(theta)))
        springs = (
            (p["k1"], p["L1"], p["alpha1"], -p["w"], -1.0),
            (p["k2"], p["L2"], p["alpha2"], p["w"], 1.0),
        )
        moment = 0.0
        for k, length, alpha, corner, sign in springs:
            # from the mass centre to the corner, and from the foot of the spring to the corner
            rx = corner * np.cos(theta) - p["h"] * np.sin(theta)
            ry = corner * np.sin(theta) + p["h"] * np.cos(theta)
            vx = z[0] + rx - corner + sign * length * np.cos(alpha)
            vy = z[1] + ry - p["h"] - length * np.sin(alpha)
            stretched = np.hypot(vx, vy)
            f = -k * (stretched - length) / stretched
            force = force + f * np.array([vx, vy])
            moment = moment + f * (rx * vy - ry * vx)
        gaps, rates, side, drop = self.edges(z)
        if self.points:
            normal = 0.0
            for i, k in enumerate((p["k3"], p["k4"])):
                one = self.bears(k, gaps[i], rates[i])
                normal = normal + one
                moment = moment + side[i] * one + drop[i] * self.mu * one
        else:
            normal, moment_of_line = self.line(gaps, rates, side)
            moment = moment + moment_of_line + self.mu * normal * p["h"]
        damping = self.unit @ z[3:] * self.zeta
        total = np.array([force[0] + self.mu * normal, force[1] - p["F_n"] + normal, moment])
        return total - damping, normal

    def bears(self, k, gap, rate):
        return np.where(gap < 0.0, -k * gap * np.maximum(0.0, 1.0 - self.a * rate), 0.0)

    def line(self, gaps, rates, side):
        """Normal force of the line and its moment."""
        gl, gt = gaps
        apart = gl - gt
        middle = (gl + gt) / np.where(apart == 0.0, 1.0, apart)
        low = np.where(gl > 0.0, np.where(gt < 0.0, middle, 1.0), -1.0)
        high = np.where(gt > 0.0, np.where(gl < 0.0, middle, 1.0), 1.0)
        high = np.where((gl > 0.0) & (gt > 0.0), 1.0, high)
        normal = 0.0
        moment = 0.0
        for node in GAUSS:  # two points are exact for a cubic
            s = 0.5 * (low + high) + 0.5 * (high - low) * node
            share_l = 0.5 * (1.0 - s)
            share_t = 0.5 * (1.0 + s)
            weight = np.where(high > low, 1.0, 0.0) if self.mean else 0.5 * (high - low)
            gap = share_l * gl + share_t * gt
            rate = share_l * rates[0] + share_t * rates[1]
            one = weight * self.bears(0.5 * self.p["k_c"], gap, rate)
            normal = normal + one
            moment = moment + (share_l * side[0] + share_t * side[1]) * one
        return normal, moment

    def rates(self, z):
        """Time derivative (6, ...) of states."""
        loads, _ = self.loads(z)
        return np.concatenate([z[3:], (loads.T / self.mass).T])

    def rest(self):
        """The place (3,) of steady sliding of a single pad."""

        def off(q):
            loads, _ = self.loads(np.append(q * SIZES, np.zeros(3)))
            return loads / self.p["F_n"] / np.array([1.0, 1.0, self.p["w"]])

        found = root(off, [0.0, 0.0 if not self.points else -0.7, 0.0], tol=1e-14)
        assert np.abs(found.fun).max() < 1e-9
        return found.x * SIZES

    def slopes(self, rest):
        """Derivatives (3, 6) of the loads about rest, by differences."""
        columns = []
        scale = np.append(SIZES, 3e4 * SIZES)
        for i in range(6):
            step = np.zeros(6)
            step[i] = 1e-4 * scale[i]
            state = np.append(rest, np.zeros(3))
            columns.append(
                (self.loads(state + step)[0] - self.loads(state - step)[0]) / 2 / step[i]
            )
        return np.array(columns).T

    def growth(self):
        """The greatest growth rate about steady sliding, 1/s."""
        lower = self.slopes(self.rest()) / self.mass[:, None]
        matrix = np.concatenate([np.eye(6)[3:], lower])
        return float(np.linalg.eigvals(matrix).real.max())

    def march(self, z, time, step=4e-7):
        """States after a time by Runge and Kutta's fourth-order method, and in which motions an
        edge separated or touched in the last tenth."""
        count = round(time / step)
        changed = np.zeros(z.shape[1], dtype=bool)
        before = self.edges(z)[0] < 0.0
        for i in range(count):
            k1 = self.rates(z)
            k2 = self.rates(z + 0.5 * step * k1)
            k3 = self.rates(z + 0.5 * step * k2)
            k4 = self.rates(z + step * k3)
            z = z + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            on = self.edges(z)[0] < 0.0
            if i > 0.9 * count:
                changed |= (on != before).any(axis=0)
            before = on
        return z, changed

    def flow(self, z, time):
        """State after a time by DOP853, restarted at each located contact change."""
        t = 0.0
        z = z.copy()
        scale = np.append(SIZES, 3e4 * SIZES)

        def leading_gap(t, y):
            return self.edges(y * scale)[0][0] / 1e-5

        def trailing_gap(t, y):
            return self.edges(y * scale)[0][1] / 1e-5

        crossing = [leading_gap, trailing_gap]
        for event in crossing:
            event.terminal = True  # type: ignore[attr-defined]
        while t < time:
            # a short step without events leaves the contact change behind
            beyond = min(time, t + 1e-9)
            how = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
            field = lambda t, y: self.rates(y * scale) / scale  # noqa: E731
            z = scale * solve_ivp(field, (t, beyond), z / scale, **how).y[:, -1]
            t = beyond
            if t < time:
                found = solve_ivp(
                    field, (t, time), z / scale, events=crossing, max_step=2e-6, **how
                )
                z = scale * found.y[:, -1]
                t = found.t[-1]
        return z

    def multipliers(self, z, period):
        """Floquet multipliers by differences of `flow`, largest first."""
        scale = np.append(SIZES, 3e4 * SIZES)
        columns = []
        for i in range(6):
            step = np.zeros(6)
            step[i] = 1e-5 * scale[i]
            columns.append(
                (self.flow(z + step, period) - self.flow(z - step, period)) / 2 / scale / 1e-5
            )
        values = np.linalg.eigvals(np.array(columns).T)
        return values[np.argsort(-np.abs(values))]

"""Frequencies, growth and amplitudes of sampled motions."""

import numpy as np

FAINT = 1e-8  # of the greatest: what is below it is rounding


def exponent(samples: np.ndarray, step: float) -> complex | None:
    """The exponent lambda of free linear motion z(t) = z0 + sum_k c_k exp(lambda_k t).

    samples (n, d): z at equal steps of time, d at least the number of components. Of the
    components that change z at least a tenth as fast as the strongest one at the end, it is that
    which grows fastest (of several that grow alike the strongest). None where the samples, and
    their first halves, are not such a motion to a thousandth or hold less than two periods (of a
    real exponent: less than 1/|lambda|).
    """
    fitted, count = None, len(samples)
    while fitted is None and count >= 32:
        fitted = _fitted(samples[:count], step)
        count //= 2  # a motion that grows is linear at its start at least
    return fitted


def _fitted(samples: np.ndarray, step: float) -> complex | None:
    """By least squares: the map from one difference of samples to the next has the eigenvalues
    exp(lambda step)."""
    steps = np.diff(samples, axis=0).T
    before, after = steps[:, :-1], steps[:, 1:]
    U, sizes, V = np.linalg.svd(before, full_matrices=False)
    rounding = 10 * np.finfo(float).eps * np.abs(samples).max() * np.sqrt(len(samples))
    rank = int(np.sum(sizes > FAINT * sizes[0] + rounding))
    if rank == 0:
        return None
    U, inverse = U[:, :rank], V[:rank].T / sizes[:rank]
    reduced = U.T @ after @ inverse
    missed = np.linalg.norm(after - U @ (reduced @ (U.T @ before)))
    if missed > 1e-3 * np.linalg.norm(after - before):
        return None
    factors, modes = np.linalg.eig(reduced)
    parts = np.abs(np.linalg.solve(modes, U.T @ after[:, -1])) * np.linalg.norm(modes, axis=0)
    with np.errstate(divide="ignore"):
        rates = np.log(factors.astype(complex)) / step
    strong = (parts >= 0.1 * parts.max()) & np.isfinite(rates)
    if not strong.any():
        return None
    alike = strong & (rates.real >= rates.real[strong].max() - 1e-6 * np.abs(rates))
    value = complex(rates[np.argmax(np.where(alike, parts, 0.0))])
    lasting, real = step * (len(samples) - 1), abs(value.imag) * step < 1e-9
    if abs(value) * lasting < 1.0 if real else abs(value.imag) * lasting < 4 * np.pi:
        return None
    small = abs(value.real) <= FAINT * abs(value)
    return complex(0.0 if small else value.real, abs(value.imag))


def _windowed(signals: np.ndarray) -> np.ndarray:
    """Without their mean, under Hann's window of sum 1, which spreads a line over few lines."""
    window = np.hanning(len(signals) + 1)[:-1, None]
    return (signals - signals.mean(axis=0)) * (window / window.sum())


def spectrum(signals: np.ndarray, step: float, finer: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (m,) and amplitudes (m, d) of signals (n, d) at equal steps, mean taken out.

    `finer` gives so many times as many frequencies. A steady sine shows its amplitude where it lies
    on a frequency, and at least 0.85 of it in between.
    """
    size = len(signals) * finer
    transform = np.fft.rfft(_windowed(signals), size, axis=0)
    return np.fft.rfftfreq(size, step), 2.0 * np.abs(transform)


def line(signals: np.ndarray, step: float) -> tuple[float, float]:
    """Frequency of the strongest line in signals (n, d) at equal steps, and its share of their
    power, that of all together; 0, 0 of signals that do not change."""
    if len(signals) < 6:
        return 0.0, 0.0
    frequencies, amplitudes = spectrum(signals, step)
    power = (amplitudes[1:] ** 2).sum(axis=1)
    if not power.max() > 0.0:
        return 0.0, 0.0
    k = int(np.argmax(power))
    share = float(power[max(k - 2, 0) : k + 3].sum() / power.sum())
    middle, width = float(frequencies[k + 1]), float(frequencies[1])
    weighted, t = _windowed(signals), step * np.arange(len(signals))
    for _ in range(3):  # closer samples of the same spectrum around its peak
        near = middle + width * np.linspace(-1.0, 1.0, 9)
        rows = np.exp(-2j * np.pi * near[:, None] * t) @ weighted
        top = (np.abs(rows) ** 2).sum(axis=1)
        i = min(max(int(np.argmax(top)), 1), 7)
        a, b, c = np.log(top[i - 1 : i + 2])
        width /= 4.0
        middle = float(near[i] + width * 0.5 * (a - c) / (a - 2.0 * b + c))
    return middle, share


def swing(signals: np.ndarray) -> np.ndarray:
    """Half of the difference between greatest and least value of smooth signals (n, d), each from
    the parabola through three samples."""
    if len(signals) < 3:
        return np.asarray(np.ptp(signals, axis=0) / 2.0)
    total, columns = np.zeros(signals.shape[1]), np.arange(signals.shape[1])
    for one in (signals, -signals):
        i = np.clip(np.argmax(one, axis=0), 1, len(one) - 2)
        a, b, c = (one[i + k, columns] for k in (-1, 0, 1))
        bend = a - 2.0 * b + c
        with np.errstate(divide="ignore", invalid="ignore"):
            peak = np.where(bend < 0.0, b - (a - c) ** 2 / (8.0 * bend), b)
        total += np.maximum(peak, one.max(axis=0))
    return total / 2.0

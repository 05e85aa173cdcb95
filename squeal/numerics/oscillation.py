"""Frequencies, growth and amplitudes of sampled motions."""

import numpy as np

FAINT = 1e-8  # of the greatest: what is below it is rounding


def exponent(samples: np.ndarray, step: float) -> complex | None:
    """The exponent of the fastest growing component of z(t) = z0 + sum_k c_k exp(lambda_k t).

    If several components grow equally fast, the exponent is that of the strongest one. The strength
    of a component is its share in the last change of z, from one sample to the next; components
    weaker than a tenth of the strongest one are left out.

    All samples are tried first, then their first half, their first quarter and so on, down to 32
    samples: a motion may be linear only at its start. The result is that of the first try whose
    samples follow such a sum to a thousandth and last two periods, or 1/|lambda| if lambda is real.

    Parameters
    ----------
    samples : array (n, d)
        z at equal steps of time, d at least the number of components.
    step : float
        The step, s.

    Returns
    -------
    complex or None
        lambda in 1/s, Im >= 0. None if no try has a result.
    """
    count = len(samples)
    while count >= 32:
        fitted = _fitted_exponent(samples[:count], step)
        if fitted is not None:
            return fitted
        count //= 2
    return None


def _fitted_exponent(samples: np.ndarray, step: float) -> complex | None:
    """The exponent of one try of `exponent`, from all the samples (n, d), which lie the time `step`
    apart; None without a result."""
    modes = _dynamic_modes(samples)
    if modes is None:
        return None
    factors, strengths = modes  # (r,) each, of the components of the motion
    with np.errstate(divide="ignore"):
        exponents = np.log(factors.astype(complex)) / step  # factor = exp(lambda step)
    # components weaker than a tenth of the strongest do not count. A factor of 0, of what is gone
    # after one step, has no finite exponent
    is_strong = (strengths >= 0.1 * strengths.max()) & np.isfinite(exponents)
    if not is_strong.any():
        return None
    fastest = exponents.real[is_strong].max()
    # growth rates that differ by less than 1e-6 |lambda| are alike: of those the strongest is taken
    grows_fastest = is_strong & (exponents.real >= fastest - 1e-6 * np.abs(exponents))
    value = complex(exponents[np.argmax(np.where(grows_fastest, strengths, 0.0))])
    duration = step * (len(samples) - 1)
    if abs(value.imag) * step < 1e-9:  # an angle in radians, which is rounding: lambda is real
        too_short = abs(value) * duration < 1.0
    else:
        too_short = abs(value.imag) * duration < 4 * np.pi  # two periods
    if too_short:
        return None
    growth_rate = value.real
    if abs(growth_rate) <= FAINT * abs(value):  # it is rounding
        growth_rate = 0.0
    return complex(growth_rate, abs(value.imag))


def _dynamic_modes(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Factors and strengths (r,) of components of samples (n, d), by dynamic mode decomposition.

    The linear map A with `after` = A `before`, in the sense of least squares, takes each difference
    of neighbouring samples to the next one. Factors are the eigenvalues exp(lambda step) of A,
    strengths the lengths of the components along its eigenvectors in the last difference.

    None where all differences are rounding, and where A `before` misses `after` by more than a
    thousandth of `after` - `before`.
    """
    differences = np.diff(samples, axis=0).T  # (d, n - 1)
    before = differences[:, :-1]
    after = differences[:, 1:]
    U, sizes, Vh = np.linalg.svd(before, full_matrices=False)
    # singular values up to that size may be rounding: of n differences, each of two samples
    rounding = 10 * np.finfo(float).eps * np.abs(samples).max() * np.sqrt(len(samples))
    rank = int(np.sum(sizes > FAINT * sizes[0] + rounding))
    if rank == 0:
        return None
    basis = U[:, :rank]
    # U' A U, where A is `after` times the pseudo-inverse V diag(1/sizes) U' of `before`
    reduced_map = basis.T @ after @ (Vh[:rank].T / sizes[:rank])
    misfit = np.linalg.norm(after - basis @ (reduced_map @ (basis.T @ before)))
    if misfit > 1e-3 * np.linalg.norm(after - before):
        return None
    factors, modes = np.linalg.eig(reduced_map)
    # the last difference, U' times it, is the sum of the modes times these components
    components = np.abs(np.linalg.solve(modes, basis.T @ after[:, -1]))
    return factors, components * np.linalg.norm(modes, axis=0)


def _windowed(signals: np.ndarray) -> np.ndarray:
    """Signals (n, d) without their mean, times Hann's window of sum 1.

    The window spreads a spectral line over few neighbours.
    """
    window = np.hanning(len(signals) + 1)[:-1, None]
    return (signals - signals.mean(axis=0)) * (window / window.sum())


def spectrum(signals: np.ndarray, step: float, finer: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (m,) and amplitudes (m, d) of signals (n, d) at equal steps, mean taken out.

    finer: how many times as many frequencies are computed, between the usual ones. A steady sine
    shows its amplitude where it lies on a frequency, and at least 0.85 of it in between.
    """
    size = len(signals) * finer
    transform = np.fft.rfft(_windowed(signals), size, axis=0)
    return np.fft.rfftfreq(size, step), 2.0 * np.abs(transform)


def strongest_line(signals: np.ndarray, step: float) -> tuple[float, float]:
    """Frequency of the strongest spectral line of signals (n, d), and its share of the power.

    The power is that of all signals together. 0 and 0 of signals that do not change, and of fewer
    than six samples, which resolve no line. step: the time between samples; the frequency is in its
    reciprocal unit.
    """
    if len(signals) < 6:
        return 0.0, 0.0
    frequencies, amplitudes = spectrum(signals, step)
    power = (amplitudes[1:] ** 2).sum(axis=1)
    if not power.max() > 0.0:
        return 0.0, 0.0
    k = int(np.argmax(power))  # power[0] belongs to frequencies[1]
    # Hann's window spreads a line over two frequencies to both sides
    share = float(power[max(k - 2, 0) : k + 3].sum() / power.sum())
    spacing = float(frequencies[1])
    return _refined_peak(signals, step, float(frequencies[k + 1]), spacing), share


def _refined_peak(signals: np.ndarray, step: float, middle: float, reach: float) -> float:
    """The frequency of the peak of the spectrum of signals (n, d) within `reach` of `middle`.

    step: the time between samples; the frequencies are in its reciprocal unit.

    Each of three passes computes nine samples of the spectrum from middle - reach to middle +
    reach. A parabola through the highest sample and its neighbours gives the next middle, and the
    next reach is the distance of neighbours.
    """
    windowed = _windowed(signals)
    times = step * np.arange(len(signals))
    for _ in range(3):  # the last one samples at a 64th of `reach`
        frequencies = middle + reach * np.linspace(-1.0, 1.0, 9)
        spacing = reach / 4.0  # of neighbouring frequencies
        transform = np.exp(-2j * np.pi * frequencies[:, None] * times) @ windowed
        power = (np.abs(transform) ** 2).sum(axis=1)
        i = min(max(int(np.argmax(power)), 1), 7)  # of 0 to 8 one with two neighbours
        # the parabola through a, b, c at -1, 0, 1 is greatest at (a - c) / (2 (a - 2 b + c)); in
        # logarithms it fits the spectral line of a Hann window closely
        a, b, c = np.log(power[i - 1 : i + 2])
        middle = float(frequencies[i] + spacing * 0.5 * (a - c) / (a - 2.0 * b + c))
        reach = spacing
    return middle


def half_range(signals: np.ndarray) -> np.ndarray:
    """Half of the range (d,) of smooth signals (n, d): of the greatest less the least value.

    Extremes between samples are those of parabolas through three samples.
    """
    if len(signals) < 3:
        return np.ptp(signals, axis=0) / 2.0
    return (_greatest_values(signals) + _greatest_values(-signals)) / 2.0


def _greatest_values(signals: np.ndarray) -> np.ndarray:
    """The greatest value (d,) of each signal (n, d), also between its samples."""
    columns = np.arange(signals.shape[1])
    greatest = np.argmax(signals, axis=0)
    i = np.clip(greatest, 1, len(signals) - 2)
    a = signals[i - 1, columns]
    b = signals[i, columns]
    c = signals[i + 1, columns]
    bend = a - 2.0 * b + c
    # the parabola through a, b, c has the top b - (a - c)^2 / (8 bend)
    is_peak = (i == greatest) & (bend < 0.0)  # a parabola at an end would reach beyond the samples
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(is_peak, b - (a - c) ** 2 / (8.0 * bend), signals.max(axis=0))

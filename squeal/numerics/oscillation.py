"""Frequencies, growth and amplitudes of sampled motions."""

import numpy as np

FAINT = 1e-8  # of the greatest: what is below it is rounding


def exponent(samples: np.ndarray, step: float) -> complex | None:
    """The exponent lambda of free linear motion z(t) = z0 + sum_k c_k exp(lambda_k t).

    It is that of the fastest growing component, of several that grow alike that of the strongest.
    Components that change z at the end less than a tenth as fast as the strongest do not count.

    Parameters
    ----------
    samples : array (n, d)
        z at equal steps of time, d at least the number of components.
    step : float
        The step, s.

    Returns
    -------
    complex or None
        1/s, Im >= 0. None where the samples are not such a motion to a thousandth or hold less than
        two periods (of a real exponent: less than 1/|lambda|), nor their first half, quarter and so
        on, of at least 32 samples.
    """
    count = len(samples)
    while count >= 32:
        fitted = _fitted_exponent(samples[:count], step)
        if fitted is not None:
            return fitted
        count //= 2  # a motion that grows is linear at its start at least
    return None


def _fitted_exponent(samples: np.ndarray, step: float) -> complex | None:
    """As `exponent`, of all samples (n, d): None if they are no such motion or too short of one."""
    modes = _dynamic_modes(samples)
    if modes is None:
        return None
    factors, strengths = modes
    with np.errstate(divide="ignore"):
        exponents = np.log(factors.astype(complex)) / step
    is_strong = (strengths >= 0.1 * strengths.max()) & np.isfinite(exponents)
    if not is_strong.any():
        return None
    fastest = exponents.real[is_strong].max()
    # within a millionth: of several that grow alike the strongest is taken
    grows_fastest = is_strong & (exponents.real >= fastest - 1e-6 * np.abs(exponents))
    value = complex(exponents[np.argmax(np.where(grows_fastest, strengths, 0.0))])
    duration = step * (len(samples) - 1)
    if abs(value.imag) * step < 1e-9:  # real, to rounding
        too_short = abs(value) * duration < 1.0
    else:
        too_short = abs(value.imag) * duration < 4 * np.pi  # two periods
    if too_short:
        return None
    if abs(value.real) <= FAINT * abs(value):  # growth of rounding
        return complex(0.0, abs(value.imag))
    return complex(value.real, abs(value.imag))


def _dynamic_modes(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Factors and strengths (r,) of components of samples (n, d), by dynamic mode decomposition.

    The linear map from one difference of samples to the next, by least squares, has the eigenvalues
    exp(lambda step): these are the factors. Strengths are the sizes of the components in the last
    difference. None where no map fits to a thousandth.
    """
    differences = np.diff(samples, axis=0).T  # (d, n - 1)
    before = differences[:, :-1]
    after = differences[:, 1:]
    U, sizes, Vh = np.linalg.svd(before, full_matrices=False)
    rounding = 10 * np.finfo(float).eps * np.abs(samples).max() * np.sqrt(len(samples))
    rank = int(np.sum(sizes > FAINT * sizes[0] + rounding))
    if rank == 0:
        return None
    basis = U[:, :rank]
    # the map `after` times the pseudo-inverse V diag(1/sizes) U' of `before`, in coordinates of the
    # basis
    reduced_map = basis.T @ after @ (Vh[:rank].T / sizes[:rank])
    misfit = np.linalg.norm(after - basis @ (reduced_map @ (basis.T @ before)))
    if misfit > 1e-3 * np.linalg.norm(after - before):
        return None
    factors, modes = np.linalg.eig(reduced_map)
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
    peak = float(frequencies[k + 1])
    return _refined_peak(signals, step, start=peak, spacing=float(frequencies[1])), share


def _refined_peak(signals: np.ndarray, step: float, start: float, spacing: float) -> float:
    """The frequency of the peak of a spectrum next to the frequency `start`.

    The spectrum is sampled ever more closely around it, at first over the `spacing` between the
    frequencies of `spectrum` to both sides.
    """
    windowed = _windowed(signals)
    times = step * np.arange(len(signals))
    middle = start
    reach = spacing
    for _ in range(3):
        frequencies = middle + reach * np.linspace(-1.0, 1.0, 9)
        transform = np.exp(-2j * np.pi * frequencies[:, None] * times) @ windowed
        power = (np.abs(transform) ** 2).sum(axis=1)
        i = min(max(int(np.argmax(power)), 1), 7)
        # the top of the parabola through the logarithms of three samples; the next round samples
        # as far to both sides as these are apart
        a, b, c = np.log(power[i - 1 : i + 2])
        reach /= 4.0
        middle = float(frequencies[i] + reach * 0.5 * (a - c) / (a - 2.0 * b + c))
    return middle


def swing(signals: np.ndarray) -> np.ndarray:
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
    is_peak = (i == greatest) & (bend < 0.0)  # a parabola at an end would reach beyond the samples
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(is_peak, b - (a - c) ** 2 / (8.0 * bend), signals.max(axis=0))

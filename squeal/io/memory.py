"""What fits into memory."""

import math
import os

ROW = 64  # bytes a row that the pointers of a sparse matrix and of what is made of it take


def available_memory() -> float:
    """Bytes that are free on this machine; unlimited where it does not say."""
    try:
        with open("/proc/meminfo", encoding="ascii") as stream:
            for line in stream:
                if line.startswith("MemAvailable:"):
                    return 1024.0 * float(line.split()[1])
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (OSError, ValueError, AttributeError):
        return math.inf


def check_rows(rows: float, where: str = "") -> None:
    """Refuse a sparse matrix of so many rows if its empty rows alone are more than is free.

    `where` says what asks for them. Raises ValueError.
    """
    free = available_memory()
    if ROW * rows > free:
        raise ValueError(
            f"{where}{rows:.6g} rows need {ROW * rows / 1e9:.2g} GB, and {free / 1e9:.2g} GB are "
            "free"
        )

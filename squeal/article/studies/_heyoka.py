"""Whether heyoka is there, without which some studies are left out."""

from squeal.io.provenance import NOT_INSTALLED, version


def has_heyoka() -> bool:
    """Whether heyoka is installed."""
    return version("heyoka") != NOT_INSTALLED


def without_heyoka(reason: str) -> str:
    """A sentence on why a study is left out, empty where heyoka is installed; reason: what nothing
    else does."""
    return "" if has_heyoka() else f"Left out here, since heyoka is not installed: {reason}"

"""`.venv/apart/bin/python workflow/release/check_crate.py FOLDER`: is it a Workflow Run RO-Crate?

Checked against the profiles that `roc-validator` ships, without a network: the one context that it
asks for is answered from the copy in `rocrate`, everything else is refused.
"""

from __future__ import annotations

import sys
from importlib import resources
from pathlib import Path
from typing import Any

import requests
from requests.adapters import HTTPAdapter
from rocrate_validator import models, services

# RO-Crate 1.1 names the workflow terms without the last part; that copy is of a later version
SHIPPED = resources.files("rocrate.data").joinpath("ro-crate.jsonld").read_bytes()
CONTEXT = SHIPPED.replace(b"https://bioschemas.org/terms/", b"https://bioschemas.org/")
PROFILES = ("ro-crate-1.1", "process-run-crate", "workflow-run-crate")


def answered(self: HTTPAdapter, request: Any, **_: Any) -> requests.Response:
    """The context from the copy at hand; nothing else is there."""
    response = requests.Response()
    response.url = request.url
    response.request = request
    known = request.url.startswith("https://w3id.org/ro/crate/")
    response.status_code = 200 if known else 404
    response._content = CONTEXT if known else b""
    response.headers["Content-Type"] = "application/ld+json"
    return response


def problems(folder: Path, profile: str) -> list[str]:
    """What the profile requires and the folder lacks."""
    settings = services.ValidationSettings(
        rocrate_uri=str(folder),
        profile_identifier=profile,
        requirement_severity=models.Severity.REQUIRED,
        no_cache=True,
    )
    found = services.validate(settings)
    return [f"{profile}: {issue.message}" for issue in found.get_issues()]


if __name__ == "__main__":
    HTTPAdapter.send = answered
    failed = [line for profile in PROFILES for line in problems(Path(sys.argv[1]), profile)]
    print("\n".join(failed) or f"{sys.argv[1]}: valid {', '.join(PROFILES)}")
    sys.exit(bool(failed))

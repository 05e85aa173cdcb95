#!/usr/bin/env bash
# Are there packages for every platform and Python that the lock names? Nothing is installed.
set -euo pipefail
cd "$(dirname "$0")/../.."
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
for platform in {x86_64,aarch64}-manylinux_2_28 aarch64-apple-darwin x86_64-pc-windows-msvc; do
    for python in 3.11 3.12 3.13 3.14; do
        # these two are built from source where there is no wheel
        .venv/bin/uv --quiet pip install --dry-run --target "$place" --python-platform $platform \
            --python-version $python --only-binary :all: --no-binary connection-pool \
            --no-binary immutables --require-hashes -r requirements/environment.txt
        echo "$platform, Python $python: complete"
    done
done

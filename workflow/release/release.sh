#!/usr/bin/env bash
# `release.sh VERSION`: sets the version everywhere, checks, commits, tags and packs. It uploads nothing.
set -euo pipefail
cd "$(dirname "$0")/../.."
version=${1:?the version, such as 0.2.0}
[[ $version =~ ^[0-9]+\.[0-9]+\.[0-9]+$ ]] || { echo "release.sh: $version is no version such as 0.2.0" >&2; exit 2; }
[ -z "$(git status --porcelain)" ] || { echo "release.sh: commit your changes first" >&2; exit 2; }
grep -q "^## $version" CHANGELOG.md || { echo "release.sh: CHANGELOG.md has no entry ## $version" >&2; exit 2; }
old=$(sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
today=$(date +%F)

sed -i "s/^version = \"${old//./\\.}\"/version = \"$version\"/" pyproject.toml
sed -i "s/^__version__ = .*/__version__ = \"$version\"/" squeal/__init__.py
sed -i "s/^\( *version:\) .*/\1 $version/; s/^\( *date-released:\) .*/\1 $today/" CITATION.cff
sed -i "/@software{squeal,/,/^}/s/version = {.*}/version = {$version}/" README.md squeal/article/report/references.bib
sed -i "s/^## $version (unreleased)/## $version ($today)/" CHANGELOG.md
make metadata cite-check lint test dist
git commit -aqm "Release $version"
git tag -a "v$version" -m "squeal $version"
echo "v$version is tagged and packed in dist/. To publish it:"
echo "  git push --follow-tags && .venv/archive/bin/twine upload dist/*"

# make report   everything, up to paper/report.pdf      make test   environment and tests
# make quick    style and the tests that most changes need, in a minute
# make two-ways  20,000 questions asked in two ways, for hours
# make any-input  20,000 broken and valid inputs of the commands, for an hour
# make refute   systems whose answer is known by construction, and wrong answers for the referee
# make real-files  files as other programs write them, against the frequencies that these print
# make fuzz     a million changed inputs of the readers, for hours
# make lint     style and types                         make lock   pin newer dependencies
# make benchmark  speed against other programs       make cite-check  citation files
# make verify   is the build the one that was described?  make manifest  describe it anew
# make dispatches  does the report print the same with other instructions? half an hour, after make report
# make site     documentation, docs/_build/html/index.html, its links checked
# make pages    does every command and snippet of README and documentation run, with the wheel alone?
# make dist     wheel and sdist                         make codecheck   codecheck.yml against a build
# make rescience  the report's metadata for ReScience C, dist/metadata.yaml, after make report
# make archive  report, page, site, data, scenes and packages as one file for a repository, in dist/
# make cluster  what profiles/slurm needs               make cluster-test   a try on a node of its own
# make brake DATA=folder   a published brake of 4669 degrees of freedom (its matrices, see docs/published.md)
# make machines DIRECTORY=...  install, build and test on fresh machines, releases of Debian there
# make platforms  does the lock hold packages for every platform?
# make page     the live page, page/built/squeal.html   make page-test   its tests
# make sbom     what is installed, with licences: dist/sbom.json (CycloneDX), dist/licences.txt
# make audit    known vulnerabilities of what is locked; asks the registry
# make clean    remove what was built                   make distclean   ... and the environment
# PYTHON=... chooses the interpreter of a new environment.

BIN := .venv/bin
ENVIRONMENT := .venv/environment.stamp
# documentation, peers of the benchmarks, cluster, fuzz
DEVELOP := .venv/develop.stamp
# release, audit and citation, whose requirements exclude those of the project
APART := .venv/apart/stamp
ARCHIVED := dist/squeal-$(shell sed -n 's/^version = "\(.*\)"/\1/p' pyproject.toml)
# by name: of a folder snakefmt reads nothing where the path to it holds a folder `build`, say
RULES := Snakefile $(wildcard workflow/rules/*.smk)
UV_COMPILE := $(BIN)/uv pip compile --quiet --upgrade --universal --python-version 3.11 \
	--fork-strategy fewest --generate-hashes --no-header

EPOCH := SOURCE_DATE_EPOCH=1609459200
# address of the repository at its public host, for packages; there is none yet
URL :=

export PATH := $(CURDIR)/$(BIN):$(PATH)
# else each of the many processes that start would compile the package anew
unexport PYTHONDONTWRITEBYTECODE

.PHONY: report test verify manifest dispatches test-without-heyoka two-ways any-input refute real-files fuzz lint benchmark \
	page page-test pages site dist archive cluster cluster-test machines platforms metadata rescience codecheck cite-check sbom audit lock clean distclean

report: $(ENVIRONMENT)
	@workflow/setup/report.sh

test: $(ENVIRONMENT)
	@. workflow/setup/system.sh; store_here; $(BIN)/pytest $(TESTS)

.PHONY: quick help
help:
	@sed -n '/^#/!q; s/^# //p' Makefile

quick: $(ENVIRONMENT)
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/snakefmt --check $(RULES)
	@$(BIN)/pytest tests/test_house.py tests/model tests/linear tests/cli/test_cli.py

# as on systems that heyoka is not made for; its tests skip
test-without-heyoka: $(ENVIRONMENT)
	@. workflow/setup/system.sh; store_here; \
		PYTHONPATH="$(CURDIR)/tests/without_heyoka" $(BIN)/pytest -rs $(TESTS)

# one question by two of our own ways, at random places
two-ways: $(ENVIRONMENT)
	@TWO_WAYS=20000 $(BIN)/pytest tests/two_ways

# whatever is typed or read is answered or refused
any-input: $(ENVIRONMENT)
	@ANY_INPUT=20000 $(BIN)/pytest tests/cli/test_any_input.py

# COUNT=systems in all, from number START on, of SEED, of up to ROWS rows; hours
refute: $(ENVIRONMENT)
	@$(BIN)/python -m benchmarks.refute --count $(or $(COUNT),100000) --start $(or $(START),0) \
		--seed $(or $(SEED),0) --rows $(or $(ROWS),30)

real-files: $(ENVIRONMENT)
	@$(BIN)/python -m workflow.trials.real_files

fuzz: $(DEVELOP)
	@$(BIN)/python -m benchmarks.fuzz

lint: $(ENVIRONMENT)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/snakefmt --check $(RULES)

benchmark: $(DEVELOP)
	$(BIN)/python -m benchmarks.precision figures/benchmark.pdf
	if command -v g++ > /dev/null; then $(BIN)/python -m benchmarks.floor; fi
	$(BIN)/python benchmarks/map.py
	$(BIN)/python -m benchmarks.large_peers
	$(BIN)/python -m benchmarks.calculix_peers

brake: $(ENVIRONMENT)
	@$(BIN)/python -m benchmarks.published_brake $(DATA)

page: $(ENVIRONMENT)
	@$(BIN)/python -m page.build

# without npm or a registry axe-core is missing, and its tests skip
page-test: $(ENVIRONMENT)
	-@test -d page/node_modules/axe-core || npm ci --silent --ignore-scripts --prefix page
	@$(BIN)/pytest -n 0 -rs page/tests

# PAGES=docs/start.md: these alone
pages: $(ENVIRONMENT)
	@$(BIN)/python -m workflow.trials.pages $(PAGES)

# on one thread, since on a busy machine two of them wait for each other without end
# with the live page, where clang and lld 19 can build it
site: $(DEVELOP)
	-@$(BIN)/python -m page.build
	$(EPOCH) OPENBLAS_NUM_THREADS=1 $(BIN)/sphinx-build -q -W --keep-going -b html docs docs/_build/html
	$(BIN)/python -m workflow.release.links docs/_build/html

dist: $(APART)
	mkdir -p dist && rm -f dist/*.whl dist/*.tar.gz
	$(EPOCH) $(BIN)/python -m workflow.release.dist dist $(URL)
	.venv/apart/bin/twine check --strict dist/*.whl dist/*.tar.gz

archive: $(APART) report site dist
	$(BIN)/python -m workflow.release.gather $(ARCHIVED)
	.venv/apart/bin/python workflow/release/crate.py $(ARCHIVED)
	.venv/apart/bin/python workflow/release/check_crate.py $(ARCHIVED)
	$(BIN)/python workflow/release/pack.py $(ARCHIVED)

verify: $(ENVIRONMENT)
	@$(BIN)/python -m workflow.release.verify

dispatches: $(ENVIRONMENT)
	@nice -n 10 $(BIN)/python -m workflow.trials.dispatches $(STUDY)

manifest: $(ENVIRONMENT)
	@$(BIN)/python -m workflow.release.verify --write

sbom: $(APART)
	mkdir -p dist
	.venv/apart/bin/cyclonedx-py environment $(BIN)/python --pyproject pyproject.toml \
		--output-reproducible --output-file dist/sbom.json
	$(BIN)/python workflow/release/licences.py dist/sbom.json > dist/licences.txt

audit: $(APART)
	.venv/apart/bin/pip-audit --strict --require-hashes --disable-pip \
		$(foreach list,$(wildcard requirements/*.txt),-r $(list))

codecheck: $(ENVIRONMENT)
	$(BIN)/python -m workflow.release.codecheck --check

cluster: $(DEVELOP)

cluster-test: $(DEVELOP)
	@workflow/cluster/node.sh start
	@nice -n 10 $(BIN)/python workflow/cluster/prove.py; status=$$?; workflow/cluster/node.sh stop; exit $$status

metadata: $(ENVIRONMENT)
	$(BIN)/python -m workflow.release.codemeta > codemeta.json
	$(BIN)/python -m workflow.release.codecheck > codecheck.yml
	$(BIN)/python -m workflow.release.journal > .paper.md && mv .paper.md paper/paper.md

rescience: $(ENVIRONMENT)
	@mkdir -p dist
	@$(BIN)/python -m workflow.release.rescience > dist/metadata.yaml

cite-check: $(APART) $(ENVIRONMENT)
	.venv/apart/bin/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	.venv/apart/bin/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	.venv/apart/bin/check-jsonschema --builtin-schema vendor.github-issue-forms \
		.github/ISSUE_TEMPLATE/bug.yml .github/ISSUE_TEMPLATE/need.yml
	.venv/apart/bin/check-jsonschema --builtin-schema vendor.github-issue-config .github/ISSUE_TEMPLATE/config.yml
	$(BIN)/python -m workflow.release.codemeta | diff codemeta.json -
	$(BIN)/python -m workflow.release.codecheck | diff codecheck.yml -
	$(BIN)/python -m workflow.release.journal | diff paper/paper.md -

lock: $(ENVIRONMENT)
	$(UV_COMPILE) pyproject.toml --extra search --extra proof --group workflow --group test --group lint \
		--group build --group installer -o requirements/environment.txt
	$(UV_COMPILE) --group docs --group benchmark --group cluster --group fuzz \
		-c requirements/environment.txt -o requirements/develop.txt
	$(UV_COMPILE) --group archive --group audit --group cite -o requirements/apart.txt

clean:
	rm -rf dist logs page/built docs/_build docs/generated .snakemake .pytest_cache .mypy_cache .ruff_cache
	find squeal page tests workflow -name __pycache__ -prune -exec rm -rf {} +
	rm -rf $(filter-out %/README.md %/brake.png %/hammering.png,$(wildcard results/* figures/*)) paper/generated
	rm -f $(filter-out %.tex,$(wildcard paper/report.*))

distclean: clean
	rm -rf .venv

$(ENVIRONMENT): pyproject.toml requirements/environment.txt
	@workflow/setup/environment.sh
	@touch $@

machines:
	@workflow/setup/machines.sh $(or $(DIRECTORY),$(error DIRECTORY=... is needed, outside the repository))

platforms: $(ENVIRONMENT)
	@workflow/setup/platforms.sh

$(DEVELOP): requirements/develop.txt $(ENVIRONMENT)
	@workflow/setup/environment.sh develop
	@touch $@

$(APART): requirements/apart.txt $(ENVIRONMENT)
	@workflow/setup/apart.sh
	@touch $@

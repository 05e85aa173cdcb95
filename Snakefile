# From the scenes to the report: `snakemake`. squeal/article/contents.py says what there is; a rule
# for each kind of job calls a program of the package that can be run by hand. Inputs named `package`
# stand for the files of the package that the program imports, `lock` for the versions of all others.
import os
import sys
from pathlib import Path

sys.path.insert(0, workflow.basedir)

from squeal.article.cases import HISTORY_FIGURES
from squeal.article.contents import (
    FIGURES,
    REPRODUCIBLE,
    RESULTS,
    STUDIES,
    TABLES,
    figure_files,
    scene_file,
)
from workflow.processes import begin
from workflow.sources import commit_file, sources_file

LOCK = "requirements/environment.txt"
RUNNING = begin()

# jobs run the Python that runs Snakemake, on one core each, and write equal bytes whenever they run;
# the C library keeps the memory of freed arrays for the next, which are many and of like size
os.environ.update(
    PATH=os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()]),
    OPENBLAS_NUM_THREADS="1",
    MALLOC_MMAP_THRESHOLD_=str(2**25),
    MALLOC_TRIM_THRESHOLD_=str(2**28),
    SOURCE_DATE_EPOCH="1609459200",
    FORCE_SOURCE_DATE="1",
)


localrules:
    all,
    everything_but_pdf,


rule all:
    input:
        "paper/report.pdf",
        "paper/supplement.pdf",


include: "workflow/rules/simulate.smk"
include: "workflow/rules/studies.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/shown.smk"

# From the scenes to the report: `snakemake --cores 2`. Every rule calls a program of the package
# that can be run by hand; its inputs name the files of the package that it imports.
import os
import sys

sys.path.insert(0, workflow.basedir)

from squeal.article.cases import CASES, HISTORY_FIGURES, STEMS
from squeal.article.report.layout import (
    CHAPTER_FIGURES,
    CHAPTER_FILES,
    EXTREME_FILES,
    FIGURES,
    IDENTIFICATION_FILES,
    LOCI_FIGURES,
    PRECISION_FIGURES,
    PRECISION_FILES,
    RESULTS,
    TABLES,
)
from squeal.article.studies import STUDIES
from squeal.files.sources import sources

PYTHON = sys.executable
SCENES = "workflow/scenes"
IDENTIFIED = "workflow/identified.json"
LOCK = "requirements/environment.txt"  # other versions may compute other numbers
ALL_FIGURES = [f"figures/fig{i:02}.{kind}" for i in FIGURES for kind in ("pdf", "txt")]
CHAPTER = [f"figures/{name}.{kind}" for name in CHAPTER_FIGURES for kind in ("pdf", "txt")]
GENERATED = [f"paper/generated/{name}" for name in TABLES]
GENERATED_IDENTIFICATION = [f"paper/generated/{name}" for name in IDENTIFICATION_FILES]
GENERATED_EXTREME = [f"paper/generated/{name}" for name in EXTREME_FILES]
GENERATED_PRECISION = [f"paper/generated/{name}" for name in PRECISION_FILES]
GENERATED_CHAPTER = [f"paper/generated/{name}" for name in CHAPTER_FILES]
STEM = {f"{number:02}": stem for stem, number in HISTORY_FIGURES.items()}

# equal bytes whenever it is built
os.environ["SOURCE_DATE_EPOCH"] = "1609459200"
os.environ["FORCE_SOURCE_DATE"] = "1"


localrules:
    all,
    everything_but_pdf,


rule all:
    input:
        "paper/report.pdf",


rule everything_but_pdf:
    input:
        ALL_FIGURES,
        CHAPTER,
        GENERATED,
        GENERATED_CHAPTER,
        "figures/robustness.pdf",
        GENERATED_IDENTIFICATION,
        GENERATED_EXTREME,
        [f"figures/{name}.pdf" for name in PRECISION_FIGURES],
        GENERATED_PRECISION,


rule simulate:
    input:
        lock=LOCK,
        scene=f"{SCENES}/{{scene}}.yaml",
        package=sources("squeal.commands.simulate"),
    output:
        history="results/{scene}.csv",
        summary="results/{scene}.json",
    wildcard_constraints:
        scene="b[12]-[a-d]",
    shell:
        "{PYTHON} -m squeal.commands.simulate {input.scene} --csv {output.history} --json > {output.summary}"


rule study:
    input:
        lock=LOCK,
        files=lambda wildcards: [f"workflow/{name}" for name in STUDIES[wildcards.name]],
        program=sources("squeal.article.studies.__main__"),
        package=lambda wildcards: sources(f"squeal.article.studies.{wildcards.name}"),
    output:
        "results/{name}.json",
    wildcard_constraints:
        name="|".join(STUDIES),
    shell:
        "{PYTHON} -m squeal.article.studies {wildcards.name} {input.files} > {output}"


rule sketch:
    input:
        lock=LOCK,
        scene=lambda wildcards: f"{SCENES}/b{int(wildcards.number)}-c.yaml",
        package=sources("squeal.article.figures.sketch"),
    output:
        pdf="figures/fig{number}.pdf",
        text="figures/fig{number}.txt",
    wildcard_constraints:
        number="01|02",
    shell:
        "{PYTHON} -m squeal.article.figures.sketch {input.scene} --pdf {output.pdf}"


rule chart:
    input:
        lock=LOCK,
        package=sources("squeal.article.figures.charts"),
    output:
        pdf="figures/fig{number}.pdf",
        text="figures/fig{number}.txt",
    wildcard_constraints:
        number="03|08",
    params:
        model=lambda wildcards: "B1" if wildcards.number == "03" else "B2",
    shell:
        "{PYTHON} -m squeal.article.figures.charts {params.model} --pdf {output.pdf}"


rule history:
    input:
        history=lambda wildcards: f"results/{STEM[wildcards.number]}.csv",
        summary=lambda wildcards: f"results/{STEM[wildcards.number]}.json",
        package=sources("squeal.plots.histories"),
    output:
        pdf="figures/fig{number}.pdf",
        text="figures/fig{number}.txt",
    wildcard_constraints:
        number="|".join(STEM),
    params:
        stem=lambda wildcards: f"results/{STEM[wildcards.number]}",
    shell:
        "{PYTHON} -m squeal.plots.histories {params.stem} --pdf {output.pdf}"


rule quasi_static:
    input:
        map="results/quasi_static.json",
        cases=expand(f"{SCENES}/b2-{{case}}.yaml", case=CASES),
        package=sources("squeal.article.figures.quasi_static"),
    output:
        pdf="figures/fig13.pdf",
        text="figures/fig13.txt",
    shell:
        "{PYTHON} -m squeal.article.figures.quasi_static {input.map} --mark {input.cases} --pdf {output.pdf}"


rule loci_figure:
    input:
        results="results/loci.json",
        package=lambda wildcards: sources(f"squeal.article.figures.{wildcards.name}"),
    output:
        pdf="figures/{name}.pdf",
        text="figures/{name}.txt",
    wildcard_constraints:
        name="|".join(LOCI_FIGURES),
    shell:
        "{PYTHON} -m squeal.article.figures.{wildcards.name} {input.results} --pdf {output.pdf}"


rule angle_maps:
    input:
        angles="results/angles.json",
        map="results/quasi_static.json",
        package=sources("squeal.article.figures.angle_maps"),
    output:
        pdf="figures/maps.pdf",
        text="figures/maps.txt",
    shell:
        "{PYTHON} -m squeal.article.figures.angle_maps {input.angles} {input.map} --pdf {output.pdf}"


rule growth_figure:
    input:
        results="results/stability.json",
        package=sources("squeal.article.figures.growth"),
    output:
        pdf="figures/growth.pdf",
        text="figures/growth.txt",
    shell:
        "{PYTHON} -m squeal.article.figures.growth {input.results} --pdf {output.pdf}"


rule robustness_figure:
    input:
        results="results/robustness.json",
        package=sources("squeal.article.figures.robustness"),
    output:
        pdf="figures/robustness.pdf",
        text="figures/robustness.txt",
    shell:
        "{PYTHON} -m squeal.article.figures.robustness {input.results} --pdf {output.pdf}"


rule identification_tables:
    input:
        formulations="results/verify.json",
        robustness="results/robustness.json",
        caption="figures/robustness.txt",
        package=sources("squeal.article.report.identification"),
    output:
        GENERATED_IDENTIFICATION,
    shell:
        "{PYTHON} -m squeal.article.report.identification --formulations {input.formulations} "
        "--robustness {input.robustness} --caption {input.caption} --out paper/generated"


rule extreme_tables:
    input:
        results="results/extreme.json",
        accuracy="results/accuracy.json",
        package=sources("squeal.article.report.extreme"),
    output:
        GENERATED_EXTREME,
    shell:
        "{PYTHON} -m squeal.article.report.extreme {input.results} {input.accuracy} --out paper/generated"


rule precision_figure:
    input:
        results="results/precision.json",
        package=lambda wildcards: sources(f"squeal.article.figures.{wildcards.name}"),
    output:
        pdf="figures/{name}.pdf",
        text="figures/{name}.txt",
    wildcard_constraints:
        name="|".join(PRECISION_FIGURES),
    shell:
        "{PYTHON} -m squeal.article.figures.{wildcards.name} {input.results} --pdf {output.pdf}"


rule precision_tables:
    input:
        results="results/precision.json",
        texts=[f"figures/{name}.txt" for name in PRECISION_FIGURES],
        package=sources("squeal.article.report.precision"),
    output:
        GENERATED_PRECISION,
    shell:
        "{PYTHON} -m squeal.article.report.precision {input.results} --figures {input.texts} "
        "--out paper/generated"


rule chapter_tables:
    input:
        study="results/stability.json",
        loci="results/loci.json",
        angles="results/angles.json",
        map="results/quasi_static.json",
        texts=[f"figures/{name}.txt" for name in CHAPTER_FIGURES],
        package=sources("squeal.article.report.stability"),
    output:
        GENERATED_CHAPTER,
    shell:
        "{PYTHON} -m squeal.article.report.stability {input.study} {input.loci} {input.angles} {input.map} "
        "--figures {input.texts} --out paper/generated"


rule tables:
    input:
        scenes=expand(f"{SCENES}/{{stem}}.yaml", stem=HISTORY_FIGURES),
        results=expand(
            "results/{name}.json",
            name=RESULTS,
        ),
        texts=[f"figures/fig{i:02}.txt" for i in FIGURES],
        package=sources("squeal.article.report.build"),
    output:
        GENERATED,
    shell:
        "{PYTHON} -m squeal.article.report.build --results results --scenes {SCENES} "
        "--figures figures --out paper/generated"


rule paper:
    input:
        "paper/report.tex",
        "squeal/article/report/references.bib",
        "paper/extreme.tex",
        "paper/identification.tex",
        "paper/precision.tex",
        "paper/stability.tex",
        GENERATED,
        GENERATED_CHAPTER,
        GENERATED_IDENTIFICATION,
        GENERATED_EXTREME,
        GENERATED_PRECISION,
        [f"figures/{name}.pdf" for name in PRECISION_FIGURES],
        "figures/robustness.pdf",
        [f"figures/fig{i:02}.pdf" for i in FIGURES],
        [f"figures/{name}.pdf" for name in CHAPTER_FIGURES],
    output:
        "paper/report.pdf",
    log:
        "paper/generated/tex/latexmk.log",
    shell:
        "BIBINPUTS=$PWD/squeal/article/report: latexmk -cd -pdf -silent -halt-on-error -interaction=nonstopmode "
        "-outdir=generated/tex paper/report.tex > {log} 2>&1 "
        "&& cp paper/generated/tex/report.pdf {output}"

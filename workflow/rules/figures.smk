# written before Snakemake looks which files there are
FIGURE_SOURCES = {
    name: sources_file("squeal.article.figures.__main__", f"squeal.article.figures.{figure.module}")
    for name, figure in REPRODUCIBLE.items()
}


rule figure:
    input:
        files=lambda wildcards: REPRODUCIBLE[wildcards.figure].reads,
        lock=LOCK,
        package=lambda wildcards: FIGURE_SOURCES[wildcards.figure],
    output:
        pdf="figures/{figure}.pdf",
        text="figures/{figure}.txt",
    log:
        "logs/figure/{figure}.log",
    wildcard_constraints:
        figure="|".join(REPRODUCIBLE),
    params:
        module=lambda wildcards: REPRODUCIBLE[wildcards.figure].module,
        arguments=lambda wildcards: REPRODUCIBLE[wildcards.figure].arguments,
    shell:
        "python -m workflow.processes "
        "squeal.article.figures {params.module} {params.arguments} "
        "--out {output.pdf} 2> {log}"


# differs with each machine and each run, so that nothing compares it nor the text that shows it
rule run_times:
    input:
        "benchmarks/precision.py",
        lock=LOCK,
        package=sources_file("squeal.article.figures.work"),
    output:
        pdf="figures/run_times.pdf",
        text="figures/run_times.txt",
    log:
        "logs/run_times.log",
    priority: 40  # seconds, as those of the studies
    shell:
        "python -m workflow.processes " "benchmarks.precision {output.pdf} --quick > {log} 2>&1"

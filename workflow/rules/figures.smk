rule figure:
    input:
        files=lambda wildcards: FIGURES[wildcards.figure].reads,
        lock=LOCK,
        package=lambda wildcards: sources(
            "squeal.article.figures.__main__",
            f"squeal.article.figures.{FIGURES[wildcards.figure].module}",
        ),
    output:
        pdf="figures/{figure}.pdf",
        text="figures/{figure}.txt",
    log:
        "logs/figure/{figure}.log",
    wildcard_constraints:
        figure="|".join(FIGURES),
    params:
        module=lambda wildcards: FIGURES[wildcards.figure].module,
        arguments=lambda wildcards: FIGURES[wildcards.figure].arguments,
    shell:
        "python -m workflow.processes "
        "squeal.article.figures {params.module} {params.arguments} "
        "--out {output.pdf} 2> {log}"

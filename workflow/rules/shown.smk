# For `snakemake --report`: every figure as SVG with its caption. `snakemake shown && snakemake shown
# --report report.html`
if "--report" in sys.argv:
    from squeal.article.report.captions import captions_shown

    config["captions"] = captions_shown(Path("results"))


rule picture:
    input:
        files=lambda wildcards: REPRODUCIBLE[wildcards.name].reads,
        lock=LOCK,
        package=lambda wildcards: FIGURE_SOURCES[wildcards.name],
    output:
        report(
            "figures/{name}.svg",
            caption="../report/caption.rst",
            category="Figures",
            labels=lambda wildcards: {"figure": wildcards.name},
        ),
    log:
        "logs/picture/{name}.log",
    wildcard_constraints:
        name="|".join(REPRODUCIBLE),
    params:
        module=lambda wildcards: REPRODUCIBLE[wildcards.name].module,
        arguments=lambda wildcards: REPRODUCIBLE[wildcards.name].arguments,
    shell:
        "python -m workflow.processes "
        "squeal.article.figures {params.module} {params.arguments} --out {output} 2> {log}"


rule shown:
    input:
        expand("figures/{name}.svg", name=REPRODUCIBLE),

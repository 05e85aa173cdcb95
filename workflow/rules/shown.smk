# For `snakemake --report`: every figure as SVG and every table as HTML, with number, chapter and
# title. `snakemake shown && snakemake shown --report report.html`
SHOWN = captions(Path(workflow.basedir) / "paper")
TABLES = [name for name, one in SHOWN.items() if one.kind == "table"]
# how the list names them. It is sorted as text: a second space, which no browser shows, keeps 2
# before 10. And it makes a switch of a column with two values: no category may have such a column.
NAMED = {
    name: {
        "number": f"{one.place.split()[0]} {one.number:2}",
        "chapter": one.chapter,
        "title": one.title,
    }
    for name, one in SHOWN.items()
}
# what workflow/report/caption.rst shows, with the results of the last build
BUILT = values(Path("paper/generated"))
config["captions"] = {name: plain(one.tex, BUILT) for name, one in SHOWN.items()}


rule picture:
    input:
        files=lambda wildcards: FIGURES[wildcards.name].reads,
        lock=LOCK,
        package=lambda wildcards: sources(
            "squeal.article.figures.__main__",
            f"squeal.article.figures.{FIGURES[wildcards.name].module}",
        ),
    output:
        report(
            "figures/{name}.svg",
            caption="../report/caption.rst",
            category="Figures",
            labels=lambda wildcards: NAMED[wildcards.name],
        ),
    log:
        "logs/picture/{name}.log",
    wildcard_constraints:
        name="|".join(FIGURES),
    params:
        module=lambda wildcards: FIGURES[wildcards.name].module,
        arguments=lambda wildcards: FIGURES[wildcards.name].arguments,
    shell:
        "python -m workflow.warm squeal.article.figures {params.module} {params.arguments} "
        "--out {output} 2> {log}"


rule screen_table:
    input:
        files="paper/generated/{name}.tex",
        package=sources("squeal.article.report.screen"),
    output:
        report(
            "paper/generated/{name}.html",
            caption="../report/caption.rst",
            category="Tables",
            labels=lambda wildcards: NAMED[wildcards.name],
        ),
    log:
        "logs/screen_table/{name}.log",
    wildcard_constraints:
        name="|".join(TABLES),
    shell:
        "python -m workflow.warm squeal.article.report.screen {input.files} > {output} 2> {log}"


rule shown:
    input:
        expand("figures/{name}.svg", name=FIGURES),
        expand("paper/generated/{name}.html", name=TABLES),

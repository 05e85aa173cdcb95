GENERATED = "paper/generated"
DRAWN = expand("figures/{figure}.{kind}", figure=FIGURES, kind=["pdf", "txt"])
WRITTEN = [f"{GENERATED}/{name}" for chapter in CHAPTERS for name in chapter.generated]

# a rule for each chapter, since their numbers of files differ
for chapter in CHAPTERS:

    rule:
        name:
            f"tables_{chapter.name}"
        input:
            files=chapter.reads,
            package=sources(*chapter.modules),
        output:
            expand("{folder}/{name}", folder=GENERATED, name=chapter.generated),
        log:
            f"logs/tables/{chapter.name}.log",
        params:
            chapter=chapter.name,
            folder=subpath(output[0], parent=True),
        shell:
            "python -m workflow.warm squeal.article.report {params.chapter} {input.files} "
            "--out {params.folder} 2> {log}"


rule everything_but_pdf:
    input:
        DRAWN,
        WRITTEN,


rule paper:
    input:
        "squeal/article/report/references.bib",
        expand("paper/{chapter}.tex", chapter=[chapter.name for chapter in CHAPTERS]),
        DRAWN,
        WRITTEN,
        text="paper/report.tex",
    output:
        "paper/report.pdf",
    log:
        "logs/paper.log",
    params:
        folder="generated/tex",
    shell:
        "BIBINPUTS=$PWD/squeal/article/report: latexmk -cd -pdf -silent -halt-on-error "
        "-interaction=nonstopmode -outdir={params.folder} {input.text} > {log} 2>&1 "
        "&& cp paper/{params.folder}/report.pdf {output}"

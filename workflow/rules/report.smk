DRAWN = [file for name in FIGURES for file in figure_files(name)]
GENERATED = "paper/generated"
TEXTS = ["report", "supplement"]
OWN = [
    str(path)
    for folder in ("figures", "report/tables", "studies")
    for path in Path("squeal/article", folder).glob("*.py")
]


# numbers, captions and tables that the texts read; stops where a sentence no longer holds
rule text:
    input:
        results=RESULTS,
        texts=expand("paper/{text}.tex", text=TEXTS),
        package=sources_file("squeal.article.report.__main__", more=OWN),
        commit=commit_file(),
    output:
        expand("{folder}/{name}.tex", folder=GENERATED, name=["values", "captions", *TABLES]),
    log:
        "logs/text.log",
    shell:
        "python -m workflow.processes "
        "squeal.article.report {input.results} --out paper/generated 2> {log}"


rule everything_but_pdf:
    input:
        DRAWN,
        rules.text.output,


rule paper:
    input:
        "squeal/article/report/references.bib",
        "paper/preamble.tex",
        DRAWN,
        rules.text.output,
        text="paper/{text}.tex",
    output:
        "paper/{text}.pdf",
    log:
        "logs/{text}.log",
    wildcard_constraints:
        text="|".join(TEXTS),
    params:
        folder="generated/tex",
        # from paper/ and, as other versions of latexmk run BibTeX, from its folder; an absolute path
        # with a comma or letters beyond ASCII would not be found
        bib="../squeal/article/report:../../../squeal/article/report:",
    shell:  # from nothing: what a run that was killed or failed has left stops the next one
        "rm -f paper/{params.folder}/{wildcards.text}.* "
        "&& BIBINPUTS={params.bib} latexmk -cd -pdf -silent -halt-on-error "
        "-interaction=nonstopmode -outdir={params.folder} {input.text} > {log} 2>&1 "
        "&& cp paper/{params.folder}/{wildcards.text}.pdf {output}"

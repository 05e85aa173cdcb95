# written before Snakemake looks which files there are
STUDY_SOURCES = {
    study: sources_file("squeal.article.studies.__main__", f"squeal.article.studies.{study}")
    for study in STUDIES
}


rule study:
    input:
        files=lambda wildcards: STUDIES[wildcards.study],
        lock=LOCK,
        package=lambda wildcards: STUDY_SOURCES[wildcards.study],
    output:
        "results/{study}.json",
    log:
        "logs/study/{study}.log",
    wildcard_constraints:
        study="|".join(STUDIES),
    shell:
        "python -m workflow.processes "
        "squeal.article.studies {wildcards.study} {input.files} > {output} 2> {log}"

# written before Snakemake looks which files there are
STUDY_SOURCES = {
    study: sources_file("squeal.article.studies.__main__", f"squeal.article.studies.{study}")
    for study in STUDIES
}
# processor time in seconds: what takes long starts first, so that all cores end together
SECONDS = {
    "onset": 85,
    "sets": 55,
    "baseline": 35,
    "accuracy": 30,
    "extreme": 25,
    "basin": 24,
    "coexistence": 18,
    "starts": 12,
    "angles": 10,
    "hammering": 9,
    "eigenvalues": 7,
    "ensemble": 7,
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
    priority: lambda wildcards: SECONDS.get(wildcards.study, 0)
    shell:
        "python -m workflow.processes "
        "squeal.article.studies {wildcards.study} {input.files} > {output} 2> {log}"

rule study:
    input:
        files=lambda wildcards: STUDIES[wildcards.study],
        lock=LOCK,
        package=lambda wildcards: sources_file(
            "squeal.article.studies.__main__", f"squeal.article.studies.{wildcards.study}"
        ),
    output:
        "results/{study}.json",
    log:
        "logs/study/{study}.log",
    wildcard_constraints:
        study="|".join(STUDIES),
    shell:
        "python -m workflow.processes "
        "squeal.article.studies {wildcards.study} {input.files} > {output} 2> {log}"

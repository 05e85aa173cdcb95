scattergather:
    part=8,


# The searches of the chapter on ensembles, `--config stages=10` for a few; a stage that stands in
# the folder, of an interrupted job too, is not drawn again.
rule searches:
    input:
        lock=LOCK,
        package=sources("squeal.article.ensembles.draw"),
    output:
        temp(touch("results/jobs/ensembles/{scatteritem}.drawn")),
    log:
        "logs/part/ensembles/{scatteritem}.log",
    threads: 1
    resources:
        mem_mb=lambda wildcards, threads: 500 + 500 * threads,
        runtime=600,
    params:
        folder="searched/ensembles",
        stages=f"--stages {config['stages']}" if "stages" in config else "",
    shell:
        "OPENBLAS_NUM_THREADS=1 python -m squeal.article.ensembles.draw {params.folder} {params.stages} "
        "--part {wildcards.scatteritem} --workers {threads} 2> {log}"


rule searches_gathered:
    input:
        gather.part("results/jobs/ensembles/{scatteritem}.drawn"),
    output:
        "results/jobs/ensembles.npz",
    log:
        "logs/part/ensembles.log",
    params:
        folder=rules.searches.params.folder,
    shell:
        "python -m squeal.article.ensembles.gather {params.folder} --untimed > {output} 2> {log}"

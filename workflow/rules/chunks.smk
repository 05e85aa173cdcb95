# Jobs of workflow/jobs in parts: `snakemake results/jobs/b3-pads.csv`, on a cluster with
# `--workflow-profile profiles/slurm`, in more parts with `--set-scatter part=64`. The table is
# the same in any number of parts.
SCENE_OF = {
    file.stem: next(iter(yaml.safe_load(file.read_text(encoding="utf-8")).values()))["scene"]
    for file in Path(workflow.basedir).glob("workflow/jobs/*.yaml")
}


scattergather:
    part=8,


rule part:
    input:
        job="workflow/jobs/{job}.yaml",
        scene=lambda wildcards: with_named_files(Path(SCENE_OF[wildcards.job])),
        lock=LOCK,
        package=sources("squeal.cli.parts"),
    output:
        temp("results/jobs/{job}/{scatteritem}.csv"),
    log:
        "logs/part/{job}/{scatteritem}.log",
    wildcard_constraints:
        job="|".join(SCENE_OF),
    resources:
        mem_mb=1000,
        runtime=60,
    shell:
        "OPENBLAS_NUM_THREADS=1 python -m squeal.cli.parts {input.job} "
        "--part {wildcards.scatteritem} --out {output} 2> {log}"


rule gathered:
    input:
        job="workflow/jobs/{job}.yaml",
        parts=gather.part("results/jobs/{{job}}/{scatteritem}.csv"),
    output:
        "results/jobs/{job}.csv",
    log:
        "logs/part/{job}.log",
    wildcard_constraints:
        job="|".join(SCENE_OF),
    shell:
        "python -m squeal.cli.parts {input.job} --gather {input.parts} --out {output} 2> {log}"


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

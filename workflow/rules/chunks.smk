# Jobs of workflow/jobs in parts: `snakemake results/jobs/b3-pads.csv`, on a cluster with
# `--workflow-profile profiles/slurm`, in more parts with `--set-scatter part=64`, each on more cores
# with `--set-threads part=16`. The table is the same in any number of parts.
SCENE_OF = {
    file.stem: next(iter(yaml.safe_load(file.read_text(encoding="utf-8")).values()))["scene"]
    for file in Path(workflow.basedir).glob("workflow/jobs/*.yaml")
}


scattergather:
    part=8,


rule part:
    input:
        job="workflow/jobs/{job}.yaml",
        scene=lambda wildcards: SCENE_OF[wildcards.job],
        lock=LOCK,
        package=sources("squeal.commands.parts"),
    output:
        temp("results/jobs/{job}/{scatteritem}.csv"),
    log:
        "logs/part/{job}/{scatteritem}.log",
    wildcard_constraints:
        job="|".join(SCENE_OF),
    threads: 1
    resources:
        mem_mb=lambda wildcards, threads: 500 + 500 * threads,
        runtime=60,
    shell:
        "OPENBLAS_NUM_THREADS=1 python -m squeal.commands.parts {input.job} "
        "--part {wildcards.scatteritem} --workers {threads} --out {output} 2> {log}"


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
        "python -m squeal.commands.parts {input.job} --gather {input.parts} --out {output} 2> {log}"

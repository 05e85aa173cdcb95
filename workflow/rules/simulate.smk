rule simulate:
    input:
        scene=scene_file("{scene}"),
        lock=LOCK,
        package=sources_file("squeal.cli.simulate"),
    output:
        summary="results/{scene}.json",
        history="results/{scene}.csv",
    log:
        "logs/simulate/{scene}.log",
    wildcard_constraints:
        scene="|".join(HISTORY_FIGURES),
    shell:
        "python -m workflow.processes "
        "squeal simulate {input.scene} --csv {output.history} --json "
        "> {output.summary} 2> {log}"

DRAWN = expand("figures/{figure}.{kind}", figure=FIGURES, kind=["pdf", "txt"])


rule everything_but_pdf:
    input:
        RESULTS,
        DRAWN,

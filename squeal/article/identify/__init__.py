"""Parameter sets of the article's ranges: drawn, judged by its statements, and searched."""

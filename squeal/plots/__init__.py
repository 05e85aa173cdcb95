"""Figures: style and drawing parts; `answers.draw` gives the figure of an answer."""

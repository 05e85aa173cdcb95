"""The companion of the article: its claims, findings, studies, figures and report."""

"""Identification: the pad for which most of the article's statements hold."""

from squeal.article.identify.search import Found, search

__all__ = ["Found", "search"]

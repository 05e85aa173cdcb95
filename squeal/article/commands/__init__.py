"""Commands about the article, one module each."""

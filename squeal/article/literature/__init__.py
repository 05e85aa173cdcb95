"""Systems of the literature, with numbers that are known of them."""

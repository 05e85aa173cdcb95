"""Records of results that several rooms share."""

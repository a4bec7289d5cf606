"""Records of experiments: storage, merging, summaries, and export to other programs."""

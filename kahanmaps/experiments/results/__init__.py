"""Records of experiments: stored, merged, summed up, written for other programs."""

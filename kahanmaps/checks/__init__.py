"""Checks: claims about Kahan maps put to the test, each with a verdict and its evidence."""

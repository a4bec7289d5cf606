"""Checks: claims about maps are proved, refuted or supported, with evidence."""

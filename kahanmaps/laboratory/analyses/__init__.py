"""The analyses of a report, a file each; `table.py` lists them."""

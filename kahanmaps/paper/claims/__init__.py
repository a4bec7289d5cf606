"""The statements of the paper, a file a section."""

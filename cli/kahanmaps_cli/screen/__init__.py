"""Output for readers: tables, progress, colors and streams."""

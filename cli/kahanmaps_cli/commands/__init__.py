"""One file a command; each is imported only when its command runs or its help is shown."""

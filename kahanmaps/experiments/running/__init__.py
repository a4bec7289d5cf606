"""Running experiments: in this process, in children, on a cluster."""

"""Relations between the points of an orbit over Q, and steps computed from these relations."""

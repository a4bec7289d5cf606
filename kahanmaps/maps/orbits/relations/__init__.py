"""Relations between the points of one orbit, and steps by them."""

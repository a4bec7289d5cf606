"""Relations between the points of an orbit over Q, and steps by means of them."""

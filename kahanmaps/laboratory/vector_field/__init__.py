"""What a vector field tells by itself, before its map is looked at: fixed points, and which system it is."""

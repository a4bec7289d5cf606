"""Properties of a vector field that do not depend on its map: fixed points, and equivalent catalogue systems."""

"""A ball that goes on pushing where it pushes already, many steps at once: nearly all of a push. Compiled on request."""

"""A ball that goes on pushing where it pushes already, many steps at once, as in nearly all of a push."""

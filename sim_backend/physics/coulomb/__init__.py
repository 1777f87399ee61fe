"""A pushed slider on its support points: Coulomb friction at each, summed exactly instead of by an ellipsoid."""

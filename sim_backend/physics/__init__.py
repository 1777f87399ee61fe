"""The slider on the floor: shapes, limit surface, contact and the solvers, without any device or wire."""

"""How far the models of the floor are from each other: starts, closed-loop pushes and the table of the docs."""

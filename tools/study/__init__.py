"""`push study`: many whole pushes of the program, each with its own settings; tables, figures and who made them."""

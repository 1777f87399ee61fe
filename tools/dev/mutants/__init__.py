"""`make mutants`: changes our code one place at a time and says which changes no test notices; start at `__main__`."""

"""`make mutants`: change the code in one place at a time and list the changes no test notices; start at `__main__`."""

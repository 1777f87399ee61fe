"""Trying one mutant: a copied tree, the tests that reach it, and a verdict."""

"""Folding a log again and comparing every bit."""

"""The fault table, proved: every row brought about, and the reaction measured."""

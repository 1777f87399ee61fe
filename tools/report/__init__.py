"""The report of a run, made from its log: figures, tables and one HTML page."""

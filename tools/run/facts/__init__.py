"""Facts of a run for its log and its start: code, machine, bounds, figures."""

"""`push watch`: shows force, arm and base live, from the devices or from a run under way, and changes nothing."""

"""How late a loop wakes up: cyclictest, a bare loop and a complete run, measured in turn."""

"""Several runs on one page: their courses in one picture, what differs between their settings, a table."""

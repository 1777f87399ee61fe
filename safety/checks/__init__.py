"""One module a subject: each looks at one tick and returns the rows of the fault table that it finds. Pure."""

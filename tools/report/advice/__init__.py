"""What to try after a run: from the fault page, the evidence and the closed forms of the law."""

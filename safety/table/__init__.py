"""What stands beside the rows of the fault table: measures with their limits, causes and next steps."""

"""What tools/scaling is made of: runs of a series, the performance model, pictures."""

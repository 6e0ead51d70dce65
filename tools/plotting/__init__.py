"""What tools/plot is made of: reading snapshots, finding the largest clump, rendering it, laying out the figure."""

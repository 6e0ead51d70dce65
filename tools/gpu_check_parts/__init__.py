"""What tools/gpu-check is made of: programs with limits, the machine, and the stages."""

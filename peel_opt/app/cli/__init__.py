"""The command line `peel-opt`."""

"""The scatter of the given numbers, propagated to the answers."""

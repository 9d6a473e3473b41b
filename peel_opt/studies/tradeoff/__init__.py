"""Error against time: what each method pays for its digits."""

"""What happens after the snap: the motion of the detached part, and where it ends.

It starts from solved states, and finds where a motion ends among them.
"""

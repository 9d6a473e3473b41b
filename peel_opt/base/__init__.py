"""What knows nothing of rods: errors, checks, units, files, quadrature, threads.

It may know the standard library and the packages the project stands on, and nothing of the project.
"""

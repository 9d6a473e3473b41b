"""What solved curves say: sensitivities, normal forms, potentials, loops, stability, energies.

It reads `equilibria` and solves no question of its own.
"""

"""Two cohesive laws written by hand, against the law (8), at the same rod and p/T0.

A law is the traction over T0 as a function of u = y/y0.  It is differentiated symbolically, so
write it with arithmetic and CasADi functions.
"""

import casadi as ca

import peel_opt as po

# Smooth everywhere.  ``drop`` is 1 - tau without cancellation at small u.
exponential = po.CohesiveLaw(lambda u: ca.exp(-u), drop=lambda u: -ca.expm1(-u), name="exponential by hand")

# Full strength up to u = 0.3, then a straight line down to nothing: one formula between kinks.
trapezoid = po.CohesiveLaw(
    [lambda u: 1.0 + 0.0 * u, lambda u: (1.0 - u) / 0.7, lambda u: 0.0 * u],
    kinks=(0.3, 1.0),
    name="trapezoid",
)


def main(pressure_ratio: float = 0.4) -> dict[str, float]:
    """Return sbar/eta under each law, for a rod with eta = y0."""
    rod = po.Rod.from_ratio(1.0)
    lengths = {}
    for law in ("cohesive", exponential, trapezoid):
        eq = po.length_given_pressure(rod, pressure_ratio, law=law)
        lengths[eq.law] = eq.length_ratio
    return lengths


if __name__ == "__main__":
    print("detached length at p/T0 = 0.4, eta/y0 = 1")
    for name, sigma in main().items():
        print(f"{name:20s} sbar/eta = {sigma:.8f}")

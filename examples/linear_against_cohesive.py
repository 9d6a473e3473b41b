"""How far can the linear law be trusted?  As long as the tip is within y0, that is p >= T0/2.

The tip is at 2 y0 (1 - p/T0) under the linear law.  Below half the strength it leaves the range
of the adhesion, and the linear law goes on as a repulsion that is not there.
"""

import peel_opt as po

PRESSURES = (0.9, 0.7, 0.5, 0.4, 0.3)  # p/T0


def main() -> dict[str, list[float]]:
    """Return sbar/eta at the pressures above and p/T0 at sbar/eta = 3.1456, for eta = y0."""
    rod = po.Rod.from_ratio(1.0)
    found = {}
    for law in ("linear", "cohesive"):
        lengths = [po.length_given_pressure(rod, p, law=law).length_ratio for p in PRESSURES]
        held = po.pressure_given_length(rod, 3.1456, law=law)
        found[law] = [*lengths, held.pressure_ratio]
    return found


if __name__ == "__main__":
    found = main()
    print("p/T0   sbar/eta: linear law   law (8)")
    for p, linear, cohesive in zip(PRESSURES, found["linear"], found["cohesive"], strict=False):
        print(f"{p:.1f}    {linear:20.8f} {cohesive:12.8f}")
    print(f"sbar/eta = 3.1456 is held by p/T0 = {found['linear'][-1]:.6f} and {found['cohesive'][-1]:.6f}")

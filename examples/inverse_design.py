"""Which stiffness a wound dressing needs, by its Maxwell length and by what is in equilibrium on it.

A dressing of silicone on skin: work of separation 10 J/m^2, strength 20 kPa, both by order of
magnitude.  Under the suction of a vacuum therapy, 10 kPa, the flap in equilibrium shall be at least
6 mm long; and below 0.5 kPa no flap shall be left, in a bond that heals.
"""

import peel_opt as po

DRESSING = {
    "youngs_modulus": "1 MPa",
    "poisson_ratio": 0.5,
    "adhesion_strength": "20 kPa",
    "work_of_separation": "10 J/m^2",
}


def main() -> dict[str, po.Design]:
    """Return a film by its Maxwell length, and the thinnest and thickest for a held length."""
    by_length = po.design(
        DRESSING,
        free={"thickness": ("0.1 mm", "5 mm")},
        targets=po.Target("maxwell_length", equal="5 mm"),
    )
    flap = po.Target("length", at_least="6 mm", pressure="10 kPa")
    thinnest = po.design(DRESSING, free={"thickness": ("1 mm", "5 mm")}, targets=flap, minimise="thickness")
    flat = po.Target("readhesion_pressure", at_least="0.5 kPa")
    both = po.design(
        DRESSING, free={"thickness": ("1 mm", "5 mm")}, targets=[flap, flat], maximise="thickness"
    )
    return {"by length": by_length, "thinnest": thinnest, "thickest that lies flat again": both}


if __name__ == "__main__":
    for name, found in main().items():
        print(f"{name}:\n{found}\n")

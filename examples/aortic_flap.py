"""A flap of aortic media: the pressure that holds it open, and how far a pressure opens it.

The strength is that of dissected human media in the circumferential direction (Sommer et al.
2008, doi 10.1115/1.2898733); the bending stiffness is an estimate for a flap 0.7 mm thick.
"""

import peel_opt as po

MMHG = 133.322387415  # Pa


def main() -> dict[str, float]:
    """Return the numbers of the table, in SI units."""
    flap = po.Rod(bending_stiffness=2.3e-5, adhesion_strength=140.1e3, adhesion_range=0.73e-3)
    held = po.pressure_given_length(flap, length=1.9e-3)
    opened = po.length_given_pressure(flap, pressure=300.0 * MMHG)
    return {
        "eta": flap.eta,
        "pressure": held.pressure,
        "tip_height": held.tip_height,
        "length": opened.length,
        "error": max(held.error, opened.error),
    }


if __name__ == "__main__":
    found = main()
    print(f"elasto-adhesion length eta        {found['eta'] * 1e3:8.4f} mm")
    print(f"pressure that holds 1.9 mm open   {found['pressure'] / 1e3:8.4f} kPa", end="")
    print(f" = {found['pressure'] / MMHG:.2f} mmHg")
    print(f"height of its free edge           {found['tip_height'] * 1e3:8.4f} mm")
    print(f"length that 300 mmHg holds open   {found['length'] * 1e3:8.4f} mm")
    print(f"largest error of p/T0, sbar/eta    {found['error']:8.0e}")

"""Write the work-precision report of four scenes: ``python -m benchmarks.scenes``; what other scenes cost."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure as Canvas

import peel_opt as po
from peel_opt.residual.closures import Closure
from peel_opt.residual.discretisation import Transcription
from peel_opt.residual.newton import correct
from peel_opt.residual.scene_spectral import SceneSpectral
from peel_opt.residual.shape import Solution
from peel_opt.residual.spectral import Spectral
from peel_opt.studies.tradeoff.run import tradeoff

from .figures import Figure, alternating

SCENES = {
    "near the transition: r = 1, P = 1 - 1e-6": partial(
        po.length_given_pressure, po.Rod.from_ratio(1.0), 1.0 - 1e-6
    ),
    "Fig 10a: beta0 = 53.16, beta1 = 113.1": partial(po.equilibrium, beta0=53.16, beta1=113.1),
    "law (8): r = 1, P = 0.2": partial(po.length_given_pressure, po.Rod.from_ratio(1.0), 0.2),
    "stiff end: r = 0.05, P = 0.96": partial(po.length_given_pressure, po.Rod.from_ratio(0.05), 0.96),
}

ROD = po.Rod.from_ratio(1.0)

#: Scenes whose corrections are measured beside the paper's.
LOADED = {
    "friction": po.Scene(ROD, [po.SkinFriction(traction=0.05)]),
    "a stream": po.Scene(
        ROD, [po.Pressure(po.profiles.exponential(8.0)), po.SkinFriction(share=0.1), po.Weight(0.02)]
    ),
    "a curved wall": po.Scene(ROD, wall=po.Circle(0.05), natural_curvature=0.05),
    "all at once": po.Scene(
        ROD,
        [
            po.Pressure(po.profiles.linear(-0.05), dead=0.1),
            po.Weight(0.02),
            po.SkinFriction(traction=0.02),
            po.Drag(0.01),
        ],
        po.Circle(0.02),
        po.TipLoad(0.01, 1.0, -0.01),
        natural_curvature=0.02,
    ),
}

#: Held in every correction.
GIVEN = (Closure("ratio", 1.0), Closure("pressure", 0.3))

DOCS = Path(__file__).parent.parent / "docs"


def correction(eq: po.Equilibrium, mesh: Transcription) -> Callable[[], object]:
    """Newton's method from beside a state to it, on a mesh."""
    assert isinstance(eq.source, Solution)
    problem = mesh.discretise(eq.source.problem.phases)
    x = correct(problem, problem.pack(eq.source.problem.profile(eq.source.x)), GIVEN).x
    return lambda: correct(problem, x + 1e-6, GIVEN)


def figures() -> list[Figure]:
    """A correction of a scene, whose loads are differentiated automatically, over one of the paper's."""
    mesh = Spectral(nodes=16)
    plain = correction(po.length_given_pressure(ROD, 0.3), mesh)
    found = []
    for name, scene in LOADED.items():
        eq = po.solve(scene, free="length", pressure=0.3, state="unfolded")
        own, other = alternating(correction(eq, SceneSpectral(scene, mesh)), plain, repeats=25)
        note = f"{own:.2f} ms, the paper's {other:.2f} ms"
        found.append(Figure(f"(s) a correction of a scene: {name}", own / other, "", 3.0, note=note))
    return found


def main() -> None:
    """Measure, and write the tables and the picture."""
    canvas = Canvas(figsize=(9.0, 7.0), layout="constrained")
    lines = [
        "# Work and precision of four scenes",
        "",
        "Written by `python -m benchmarks.scenes`: milliseconds are medians of five calls on one core,",
        "true errors are against a spectral solve with 54 and 81 nodes a phase. `solve_bvp` is SciPy's,",
        "with the Jacobian by hand, started from the solution. iter: steps of Newton's method and of IPOPT,",
        "on all meshes; size: unknowns of the finest; evals: evaluations of the equations, with or without",
        "their Jacobian.",
        "",
        "![True error against time, four scenes](img/work_precision.png)",
    ]
    for ax, (title, ask) in zip(canvas.subplots(2, 2).flat, SCENES.items(), strict=True):
        table = tradeoff(ask)
        table.plot(ax).set_title(title, fontsize="medium")
        lines += ["", f"## {title[0].upper()}{title[1:]}", "", "```text", repr(table), "```"]
    (DOCS / "img").mkdir(parents=True, exist_ok=True)
    canvas.savefig(DOCS / "img" / "work_precision.png", dpi=110)
    (DOCS / "work_precision.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

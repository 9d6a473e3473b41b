"""How the house is built: which module may know which, and what every module keeps to."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cached_property, lru_cache
from pathlib import Path

import pytest

import peel_opt

ROOT = Path(peel_opt.__file__).parent

#: The floors from the ground up.  When a module is imported it may import from its own floor and
#: from those below; an import inside a function (a picture of a branch, say) may go up.
FLOORS = {
    "ground": "errors checks arrays blas gauss roots files quantities transcription.compiled",
    "rod and law": "rod cohesion named_laws",
    "model": "elastica arclength closures linear_operator nonlinear_part hierarchy series series_curve",
    "transcriptions": "transcription transcription.* phases shape tip_scan",
    "solvers": "newton nlp rounding",
    "walks": "points continuation batches specials primary isobars fold_system",
    "answers": "result posed closed_form answer certify question many_states detachment storage",
    "branches": "branch branch_parts assembly tracing following fold_curves fold_optimum branch_files",
    "readings": "reduction reduced_diagram effective_potential traced_potential normal_form_fit landau"
    " maxwell_points design_relations lambda_loop pressure_loop hysteresis_loops small_motions"
    " stability_along work_balance flaws solution_surface maxwell_derivative limit_derivatives"
    " implicit_derivatives",
    "studies": "cards card_tables peers method_scan work_precision calibration_* design_* inverse_design"
    " sweep_* sweeping propagation propagation_*",
    "pictures": "plots plots.*",
    "faces": "report branch_report loop_report work_report calibration_report figures figures.* explorer"
    " explorer.* cli cli_* __main__",
}

#: Longest a module may be before it is looked at for a second idea.
LONGEST = 330


@dataclass(frozen=True)
class Module:
    """One file of the package."""

    path: Path

    @property
    def name(self) -> str:
        """Dotted, without "peel_opt."; a package by its own name, the top by ""."""
        parts = self.path.relative_to(ROOT).with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    @cached_property
    def text(self) -> str:
        return self.path.read_text(encoding="utf-8")

    @cached_property
    def tree(self) -> ast.Module:
        return ast.parse(self.text)

    def nodes(self, kind: type[ast.AST]) -> Iterator[ast.AST]:
        return (node for node in ast.walk(self.tree) if isinstance(node, kind))

    def base(self, node: ast.ImportFrom) -> str:
        """Where a relative import points to, dotted."""
        here = self.path.relative_to(ROOT).parts[:-1]
        parts = [*here[: len(here) - node.level + 1], *(node.module or "").split(".")]
        return ".".join(part for part in parts if part)

    def at_import(self) -> Iterator[ast.stmt]:
        """Statements that run when the module is imported, types left out."""

        def unfold(body: list[ast.stmt]) -> Iterator[ast.stmt]:
            for statement in body:
                if isinstance(statement, ast.If | ast.Try | ast.ClassDef):
                    if "TYPE_CHECKING" not in ast.dump(getattr(statement, "test", statement)):
                        yield from unfold(statement.body)
                    yield from unfold(getattr(statement, "orelse", []))
                else:
                    yield statement

        return unfold(self.tree.body)

    def imports(self) -> set[str]:
        """Modules of the package that are imported with this one."""
        found = set()
        for node in self.at_import():
            if isinstance(node, ast.ImportFrom) and node.level:
                base = self.base(node)
                for alias in node.names:
                    inner = f"{base}.{alias.name}".strip(".")
                    found.add(inner if inner in names() else base)
        return found - {""}


MODULES = [Module(path) for path in sorted(ROOT.rglob("*.py"))]
INSIDE = [module for module in MODULES if module.name]


@lru_cache
def names() -> frozenset[str]:
    return frozenset(module.name for module in MODULES)


def floor(name: str) -> int:
    """Number of the floor of a module: an exact name counts before a pattern."""
    for exact in (True, False):
        for number, members in enumerate(FLOORS.values()):
            if any(name == m if exact else fnmatch(name, m) for m in members.split()):
                return number
    pytest.fail(f"put {name!r} on a floor of the table in {Path(__file__).name}")


def each(modules: list[Module]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("module", modules, ids=lambda module: module.name or "peel_opt")


# --- who knows whom -------------------------------------------------------------------------


@each(INSIDE)
def test_no_module_imports_from_a_higher_floor(module: Module) -> None:
    above = {name for name in module.imports() if floor(name) > floor(module.name)}
    assert not above, f"{module.name} stands on floor {list(FLOORS)[floor(module.name)]!r}"


def test_every_entry_of_the_table_is_a_module() -> None:
    for members in FLOORS.values():
        for member in members.split():
            assert any(fnmatch(name, member) for name in names()), member


@each(MODULES)
def test_no_private_name_crosses_a_module(module: Module) -> None:
    for node in module.nodes(ast.ImportFrom):
        private = [a.name for a in node.names if a.name.startswith("_") and not a.name.startswith("__")]
        assert not private, f"line {node.lineno}: {private}"
    own = {node.attr for node in module.nodes(ast.Attribute) if isinstance(node.ctx, ast.Store)}
    own |= {node.name for kind in (ast.FunctionDef, ast.ClassDef) for node in module.nodes(kind)}
    own |= {n.target.id for n in module.nodes(ast.AnnAssign) if isinstance(n.target, ast.Name)}
    own |= {t.id for n in module.nodes(ast.Assign) for t in n.targets if isinstance(t, ast.Name)}
    for node in module.nodes(ast.Attribute):
        if node.attr.startswith("_") and not node.attr.startswith("__") and node.attr not in own:
            base = node.value
            inherited = isinstance(base, ast.Name) and base.id in ("self", "cls", "os")
            assert inherited, f"line {node.lineno}: .{node.attr} belongs to another module"


@each([module for module in MODULES if module.name.split("_")[0] == "cli"])
def test_the_command_line_starts_with_the_standard_library_alone(module: Module) -> None:
    light = {"errors", "cli_common"} | {name for name in names() if name.startswith("cli_")}
    assert module.imports() <= light
    for node in module.at_import():
        if isinstance(node, ast.Import):
            assert {a.name.split(".")[0] for a in node.names} <= sys.stdlib_module_names
        elif isinstance(node, ast.ImportFrom) and not node.level:
            assert str(node.module).split(".")[0] in sys.stdlib_module_names


def test_importing_the_package_imports_nothing_heavy() -> None:
    heavy = ("numpy", "scipy", "casadi", "matplotlib", "pydantic", "pint", "bokeh", "xarray", "tqdm")
    code = f"import sys, peel_opt; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# --- what every module keeps to -------------------------------------------------------------


@each(MODULES)
def test_a_module_says_what_it_is_and_is_not_too_long(module: Module) -> None:
    assert ast.get_docstring(module.tree)
    assert len(module.text.splitlines()) <= LONGEST


@each([module for module in MODULES if module.name != "cli_common"])
def test_the_library_prints_nothing(module: Module) -> None:
    called = [node for node in module.nodes(ast.Call) if isinstance(node.func, ast.Name)]
    assert not [node.lineno for node in called if node.func.id == "print"]
    for node in module.nodes(ast.Attribute):
        assert ast.unparse(node) not in ("plt.show", "pyplot.show"), f"line {node.lineno}"


@each(MODULES)
def test_reading_a_file_never_runs_code(module: Module) -> None:
    for node in (*module.nodes(ast.Import), *module.nodes(ast.ImportFrom)):
        words = {a.name.split(".")[0] for a in node.names} | {str(getattr(node, "module", ""))}
        assert not words & {"dill", "cloudpickle", "joblib", "shelve", "marshal"}
    for node in module.nodes(ast.Call):
        called = ast.unparse(node.func)
        assert called not in ("eval", "exec", "compile")
        # To ask whether something can go to another process is no file.
        assert not called.startswith("pickle.") or called == "pickle.dumps"
        if called == "np.load":
            given = {k.arg: ast.unparse(k.value) for k in node.keywords}
            assert given.get("allow_pickle") == "False", f"line {node.lineno}"


# --- the public face ------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(peel_opt.__all__))
def test_a_public_name_is_documented(name: str) -> None:
    thing = getattr(peel_opt, name)
    text = inspect.getdoc(thing) or ""
    assert text
    if inspect.isfunction(thing):
        signature = inspect.signature(thing)
        assert not signature.parameters or "Parameters\n---" in text
        assert signature.return_annotation in (None, "None") or "Returns\n---" in text
    elif dataclasses.is_dataclass(thing) and [f for f in dataclasses.fields(thing) if f.repr]:
        assert "Parameters\n---" in text


def test_the_three_lists_of_public_names_agree() -> None:
    tree = Module(ROOT / "__init__.py").tree
    (checking,) = [n for n in tree.body if isinstance(n, ast.If)]
    typed = {a.name: n.module for n in checking.body if isinstance(n, ast.ImportFrom) for a in n.names}
    assert set(peel_opt.__all__) == set(peel_opt._HOMES)
    assert {name: home.split(".")[0] for name, home in peel_opt._HOMES.items() if name in typed} == {
        name: str(home).split(".")[0] for name, home in typed.items()
    }
    assert set(typed) == set(peel_opt.__all__)


def test_no_module_hides_a_function_of_its_name() -> None:
    assert not names() & set(peel_opt.__all__)

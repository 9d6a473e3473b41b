"""How the house is built: which module may know which, and what every module keeps to."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from graphlib import TopologicalSorter
from itertools import pairwise
from pathlib import Path

import pytest

import peel_opt

ROOT = Path(peel_opt.__file__).parent

#: The rooms in the order of the sentence "a model, made a residual, is walked as branches, answers
#: questions, is read, set in motion, studied, drawn and shown".  A module imports from its own room and
#: those before.
ROOMS = [
    "base",
    "model",
    "residual",
    "continuation",
    "equilibria",
    "analysis",
    "motion",
    "studies",
    "plots",
    "app",
]


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

    @cached_property
    def walked(self) -> list[ast.AST]:
        return list(ast.walk(self.tree))

    def nodes(self, kind: type[ast.AST]) -> Iterator[ast.AST]:
        return (node for node in self.walked if isinstance(node, kind))

    def base(self, node: ast.ImportFrom) -> str:
        """Where a relative import points to, dotted."""
        here = self.path.relative_to(ROOT).parts[:-1]
        parts = [*here[: len(here) - node.level + 1], *(node.module or "").split(".")]
        return ".".join(part for part in parts if part)

    def types(self) -> set[ast.AST]:
        """What is imported for types only, and never runs."""
        tests = (node for node in self.nodes(ast.If) if "TYPE_CHECKING" in ast.dump(node.test))
        return {inner for node in tests for statement in node.body for inner in ast.walk(statement)}

    def knows(self, *, types: bool) -> set[str]:
        """Modules of the package that are imported anywhere in this one, in its functions too."""
        left_out = set() if types else self.types()
        return self.targets(node for node in self.nodes(ast.ImportFrom) if node not in left_out)

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
        return self.targets(self.at_import())

    def targets(self, nodes: Iterable[ast.AST]) -> set[str]:
        """Modules of the package that import statements among some nodes name."""
        found = set()
        for node in nodes:
            if isinstance(node, ast.ImportFrom) and node.level:
                base = self.base(node)
                for alias in node.names:
                    inner = f"{base}.{alias.name}".strip(".")
                    found.add(inner if inner in names() else base)
        return found - {""}


Rule = Callable[[Module], None]

MODULES = [Module(path) for path in sorted(ROOT.rglob("*.py"))]
INSIDE = [module for module in MODULES if module.name not in ("", "__main__")]


@lru_cache
def names() -> frozenset[str]:
    return frozenset(module.name for module in MODULES)


def room(name: str) -> int:
    """Number of the room a module stands in."""
    return ROOMS.index(name.split(".", maxsplit=1)[0])


def described(text: str) -> set[str]:
    """Names in the section "Parameters" of a docstring: "rod : Rod", or "law, tol" alone."""
    _, _, section = text.partition("Parameters\n----------\n")
    found: set[str] = set()
    for before, line in pairwise(["", *section.splitlines()]):
        if line.startswith("---"):  # the next section, whose title was taken for a name
            return found - {before}
        if line and not line.startswith(" "):
            found |= {name.strip(" *") for name in line.partition(" : ")[0].split(",")}
    return found


def each(modules: list[Module]) -> Callable[[Rule], Callable[[], None]]:
    """Make one test of a rule for many modules; it names all that break it."""

    def tested(rule: Rule) -> Callable[[], None]:
        def test() -> None:
            broken = {}
            for module in modules:
                try:
                    rule(module)
                except AssertionError as error:
                    broken[module.name or "peel_opt"] = str(error)
            assert modules
            assert not broken

        return test

    return tested


# --- who knows whom -------------------------------------------------------------------------


@each(INSIDE)
def test_a_module_imports_from_its_own_room_and_those_before(module: Module) -> None:
    assert not {name for name in module.knows(types=True) if room(name) > room(module.name)}


def test_no_modules_know_each_other_in_a_circle() -> None:
    knows = {module.name: module.knows(types=False) - {module.name} for module in INSIDE}
    TopologicalSorter(knows).prepare()  # which names the circle, if there is one


def test_at_the_top_stand_the_rooms_and_the_face() -> None:
    found = {path.name for path in ROOT.iterdir() if path.name != "__pycache__"}
    assert found == {*ROOMS, "__init__.py", "__init__.pyi", "__main__.py", "py.typed"}


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


@each([module for module in MODULES if module.name.startswith("app.cli.")])
def test_the_command_line_starts_with_the_standard_library_alone(module: Module) -> None:
    light = {"base.errors"} | {name for name in names() if name.startswith("app.cli.")}
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
def test_a_module_says_what_it_is(module: Module) -> None:
    assert ast.get_docstring(module.tree)


@each([module for module in MODULES if module.name != "app.cli.common"])
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
        # What goes to a worker process and comes back from it is no file.
        assert not called.startswith("pickle.") or module.name in (
            "studies.sweep.workers",
            "studies.sweep.process",
        )
        if called == "np.load":
            given = {k.arg: ast.unparse(k.value) for k in node.keywords}
            assert given.get("allow_pickle") == "False", f"line {node.lineno}"


@each([module for module in MODULES if not module.name.startswith("model")])
def test_what_a_law_is_like_is_asked_of_the_law(module: Module) -> None:
    paper = {"LINEAR", "COHESIVE"}
    for node in module.nodes(ast.Compare):
        named = {inner.id for inner in ast.walk(node) if isinstance(inner, ast.Name)}
        assert not named & paper, f"line {node.lineno}: {ast.unparse(node)}"


def test_no_two_classes_share_a_name() -> None:
    homes: dict[str, list[str]] = {}
    for module in MODULES:
        for node in module.nodes(ast.ClassDef):
            homes.setdefault(node.name, []).append(module.name)
    assert not {name: where for name, where in homes.items() if len(where) > 1}


@each(MODULES)
def test_what_a_docstring_calls_a_parameter_is_one(module: Module) -> None:
    for node in module.nodes(ast.FunctionDef):
        taken = {a.arg for a in ast.walk(node.args) if isinstance(a, ast.arg)}
        strange = described(ast.get_docstring(node) or "") - taken
        assert not strange, f"line {node.lineno}, {node.name}: {sorted(strange)}"
    for node in module.nodes(ast.ClassDef):
        fields = {inner.id for inner in ast.walk(node) if isinstance(inner, ast.Name)}
        fields |= {inner.arg for inner in ast.walk(node) if isinstance(inner, ast.arg)}
        strange = described(ast.get_docstring(node) or "") - fields
        assert not strange or node.bases, f"line {node.lineno}, {node.name}: {sorted(strange)}"


# --- the public face ------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(peel_opt.__all__))
def test_a_public_name_is_documented(name: str) -> None:
    thing = getattr(peel_opt, name)
    text = inspect.getdoc(thing) or ""
    assert text
    if inspect.isfunction(thing):
        signature = inspect.signature(thing)
        assert described(text) == set(signature.parameters)
        assert signature.return_annotation in (None, "None") or "Returns\n---" in text
    elif dataclasses.is_dataclass(thing) and [f for f in dataclasses.fields(thing) if f.repr]:
        assert described(text)
        assert described(text) <= {f.name for f in dataclasses.fields(thing)}


def test_a_room_does_not_hide_the_call_of_its_name() -> None:
    code = "from peel_opt.equilibria import every; import peel_opt; print(peel_opt.equilibria.__module__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "peel_opt.equilibria.every"

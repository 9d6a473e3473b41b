"""What a release says about itself holds together: versions, extras, commands, citation."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

import peel_opt
from peel_opt.app.cli import main as cli

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
#: Extras of who works on it, which no module imports.
TOOLS = ("test", "lint", "docs", "release")
MODULES = sorted((ROOT / "peel_opt").rglob("*.py"))


def text_of(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


# --- one version ----------------------------------------------------------------------------


def test_the_version_stands_in_one_place():
    assert PROJECT["dynamic"] == ["version"]
    assert re.fullmatch(r"\d+\.\d+\.\d+", peel_opt.__version__)
    found = [
        p.name for p in MODULES if re.search(rf"\b{re.escape(peel_opt.__version__)}\b", p.read_text("utf-8"))
    ]
    assert found == ["__init__.py"]


def test_the_changelog_begins_with_this_version_and_says_which_numbers_changed():
    versions = re.split(r"^## ", text_of("CHANGELOG.md"), flags=re.MULTILINE)[1:]
    assert versions[0].startswith(peel_opt.__version__)
    for version in versions:
        assert "### Changed numbers" in version, version.splitlines()[0]


def test_the_installed_package_has_this_version_if_it_is_this_one():
    try:
        installed = metadata.distribution("peel_opt")
    except metadata.PackageNotFoundError:
        pytest.skip("run from the source tree")
    if Path(str(installed.locate_file("peel_opt"))).resolve() == Path(peel_opt.__file__).parent:
        assert installed.version == peel_opt.__version__


# --- the citation ---------------------------------------------------------------------------


def citation() -> dict[str, list[str]]:
    """Return the values of CITATION.cff by key, at any depth; it uses no more YAML than this reads."""
    found: dict[str, list[str]] = {}
    for number, line in enumerate(text_of("CITATION.cff").splitlines(), 1):
        if re.fullmatch(r"  - \w+", line):
            continue  # a keyword
        match = re.fullmatch(r'(?:  )*(?:- )?([a-z-]+):(?: ("(?:[^"\\]|\\.)*"|[^":#]+))?', line)
        assert match, f"CITATION.cff, line {number}: {line!r}"
        found.setdefault(match[1], []).append((match[2] or "").strip('"'))
    return found


def test_the_citation_has_the_version_the_licence_and_the_paper():
    found = citation()
    assert found["cff-version"] == ["1.2.0"]
    assert found["version"] == [peel_opt.__version__]
    assert found["license"] == [PROJECT["license"]] == ["MIT"]
    assert found["type"] == ["software", "article", "article", "article", "article"]
    paper = "Bifurcation analysis of pressure-induced detachment of a rod adhered to a plate"
    assert paper in found["title"]
    assert paper in " ".join(text_of("README.md").split())


def test_the_licence_is_the_one_that_is_named():
    assert text_of("LICENSE").startswith("MIT License")
    assert PROJECT["license-files"] == ["LICENSE"]


# --- what is installed ----------------------------------------------------------------------


def test_the_types_are_announced_and_there():
    assert "Typing :: Typed" in PROJECT["classifiers"]
    assert (ROOT / "peel_opt" / "py.typed").read_bytes() == b""


def test_the_classifiers_name_the_supported_versions_of_python():
    named = {c.rsplit(" ", 1)[1] for c in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", c)}
    least = PROJECT["requires-python"].removeprefix(">=")
    assert least in named
    assert named == {"3.11", "3.12", "3.13"}


def test_every_import_is_required_by_the_project_or_an_extra():
    required = {re.match(r"[\w.-]+", text)[0].lower().replace("-", "_") for text in PROJECT["dependencies"]}
    for extra, texts in PROJECT["optional-dependencies"].items():
        if extra not in TOOLS:
            required |= {re.match(r"[\w.-]+", text)[0].lower().replace("-", "_") for text in texts}
    required |= {"pydantic_core"} if "pydantic" in required else set()
    for path in MODULES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [str(node.module)]
            for name in (name.split(".")[0] for name in names):
                assert name in sys.stdlib_module_names | required | {"peel_opt"}, f"{path.name}: {name}"


def test_every_extra_that_a_message_names_exists_and_no_other():
    extras = {name for name in PROJECT["optional-dependencies"] if name not in TOOLS}
    named = set()
    for path in MODULES:
        named |= set(re.findall(r"peel_opt\[(\w+)\]", path.read_text(encoding="utf-8")))
    assert named <= extras
    documented = "\n".join(p.read_text("utf-8") for p in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
    documented += "\n".join(p.read_text("utf-8") for p in (ROOT / "benchmarks").glob("*.py"))
    for extra in extras:
        packages = [re.match(r"\w+", text)[0] for text in PROJECT["optional-dependencies"][extra]]
        used = any(f"from {name} import" in documented or f"import {name}" in documented for name in packages)
        assert extra in named or f"peel_opt[{extra}]" in documented or used, extra


def test_what_the_archive_of_sources_holds_exists():
    build = tomllib.loads(text_of("pyproject.toml"))["tool"]["hatch"]["build"]["targets"]
    for name in build["sdist"]["include"]:
        assert (ROOT / name).exists(), name
    assert {"tests", "docs", "examples", "problems"} <= set(build["sdist"]["include"])


# --- the command line -----------------------------------------------------------------------


def commands() -> list[str]:
    (group,) = (action for action in cli._parser()._actions if hasattr(action, "choices") and action.choices)
    return sorted(group.choices)


def test_every_command_is_named_in_the_help_and_explained():
    done = subprocess.run(
        [sys.executable, "-m", "peel_opt", "--help"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    documented = "\n".join(p.read_text("utf-8") for p in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
    for name in commands():
        assert re.search(rf"^ +{name}\s+\S", done.stdout, re.MULTILINE), name
        assert f"peel-opt {name}" in documented, name


def test_the_changelog_names_every_command():
    log = text_of("CHANGELOG.md")
    for name in commands():
        assert f"`{name}`" in log, name


def test_the_script_that_is_installed_is_this_one():
    assert PROJECT["scripts"] == {"peel-opt": "peel_opt.app.cli.main:main"}
    assert callable(cli.main)

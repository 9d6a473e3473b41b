"""Pages of the site that are made: of the README, the changelog, the examples and the public names.

MkDocs calls ``on_files`` and ``on_page_markdown``; see mkdocs.yml.
"""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parent

#: Files beside docs/ that are pages of the site.
BESIDE = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}

#: Pictures that examples make, in docs/img; what the others print is shown instead.
PICTURES = {
    "calibrate_flap": "calibration",
    "flaw_charts": "flaws_aortic_flap",
    "held_length_charts": "held_lengths_aortic_flap",
    "hysteresis_loop": "hysteresis",
    "load_unload_reload": "load_unload_reload",
    "maxwell_length_chart": "maxwell_length",
    "normal_form_errors": "series_error",
    "paper_fig10a": "paper_fig10a",
    "pressure_chart_sweep": "pressure_chart_sweep",
    "readme_figure": "readme",
    "scene_pictures": "scene_walls",
    "snap": "snap_aortic_flap",
    "stability_map": "stability_map",
    "tear_in_time": "tear_in_time",
}

#: The rooms of the public names, in words.
ROOMS = {
    "model": "Rods, laws and scenes",
    "equilibria": "Equilibria and branches",
    "analysis": "What is read off them",
    "motion": "What happens after the snap",
    "studies": "Studies",
    "residual": "Methods",
    "app": "Cards and citations",
    "base": "Errors",
}


def on_files(files: Files, config: Any, **_: Any) -> Files:
    """Add the pages that are made."""
    made = {page: (ROOT / name).read_text(encoding="utf-8") for name, page in BESIDE.items()}
    made |= {"gallery.md": gallery(), "reference.md": reference()}
    for page, text in made.items():
        files.append(File.generated(config, page, content=text))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Let links to what lies beside docs/ lead to the page that shows it."""
    return re.sub(r"\]\((?!http)(?:\.\./)*([^)#\s]*)(#[^)\s]*)?\)", _linked, markdown)


def _linked(match: re.Match[str]) -> str:
    path, place = match[1], match[2] or ""
    if example := re.fullmatch(r"examples/(\w+)\.py", path):
        return f"](gallery.md#{example[1]})"
    named = BESIDE | {"CITATION.cff": "citing.md"}
    return f"]({named.get(path, path.removeprefix('docs/'))}{place})"


def gallery() -> str:
    """Return a page with every example: what it shows, its picture or what it prints, and its script."""
    parts = [
        "# Gallery\n",
        "Every script of `examples/`, with what it makes. Run them as `python examples/NAME.py`.\n",
    ]
    for path in sorted((ROOT / "examples").glob("*.py")):
        script = path.read_text(encoding="utf-8")
        shows = (ast.get_docstring(ast.parse(script)) or "").replace("[", r"\[")
        title, _, more = shows.partition("\n")
        parts.append(f"## {title.rstrip('.').partition(':')[0]} {{ #{path.stem} }}\n\n{title}\n{more}\n")
        if path.stem in PICTURES:
            parts.append(f"![{title}](img/{PICTURES[path.stem]}.png)\n")
        else:
            parts.append(f"```text\n{_printed(path)}```\n")
        inside = "\n".join(f"    {line}" for line in script.splitlines())
        parts.append(f'??? example "examples/{path.name}"\n\n    ```python\n{inside}\n    ```\n')
    return "\n".join(parts)


def _printed(script: Path) -> str:
    """Return what a script prints, run with the package as it stands here."""
    env = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, script], cwd=ROOT, env=env, stdout=subprocess.PIPE, text=True, check=True
    ).stdout


def public_names() -> dict[str, list[str]]:
    """Return where each public name lives, by room, in the order of ``__init__.pyi``."""
    stub = ast.parse((ROOT / "peel_opt" / "__init__.pyi").read_text(encoding="utf-8"))
    found: dict[str, list[str]] = {room: [] for room in ROOMS}
    for node in stub.body:
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                found[node.module.partition(".")[0]].append(f"peel_opt.{node.module}.{alias.name}")
    return found


def reference() -> str:
    """Return a page with the docstring of every public name."""
    parts = [
        "# Reference\n",
        "Every public name, `po.NAME`, by what it is about. What to call for what: [api.md](api.md).\n",
    ]
    for room, names in public_names().items():
        parts.append(f"## {ROOMS[room]}\n")
        for name in names:
            options = ["heading_level: 3"]
            if name.endswith(".profiles"):  # a module: its calls, whose classes nobody makes by hand
                options.append("members: [linear, exponential, stream, mixed, jet, height]")
            parts.append("\n".join([f"::: {name}", "    options:", *(f"      {one}" for one in options), ""]))
    return "\n".join(parts)

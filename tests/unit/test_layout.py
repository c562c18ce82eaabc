"""Of the source: imports run one way, those inside functions too, without circles; kinds of warnings are declared."""

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import mechdesign
from mechdesign.commands import COMMANDS
from mechdesign.ground.cautions import ALL, KINDS

ROOT = Path(mechdesign.__file__).parent
# Folders and files from the bottom to the top; each may import what stands in its own line and above.
ORDER = (
    ("mechdesign.ground.numerics",),
    ("mechdesign.ground", "mechdesign.commands"),  # results, errors, expressions, ...; the list of questions
    ("mechdesign.ground.work",),
    ("mechdesign.mechanism",),
    ("mechdesign.study.text",),
    ("mechdesign.motion",),
    ("mechdesign.study.building",),
    ("mechdesign.questions.reliability.laws", "mechdesign.questions.reliability.fit_laws",
     "mechdesign.questions.synthesize.declared"),
    (
        "mechdesign.study.schema",
        *(f"mechdesign.questions.{name}.schema" for name in COMMANDS), "mechdesign.experiments.schema",
    ),
    ("mechdesign.study",),
    ("mechdesign.questions", "mechdesign.region"),
    ("mechdesign.questions.kinematics",),
    # The force method, by which dynamics finds moments that equilibrium leaves open.
    tuple(f"mechdesign.questions.stiffness.{name}" for name in
          ("__init__", "applied", "bodies", "compliance", "elements", "couplings", "force_method", "network", "screws",
           "self_stress")),
    ("mechdesign.questions.dynamics",),
    ("mechdesign.questions.stiffness",),
    ("mechdesign.questions.reliability",),
    ("mechdesign.questions.workspace",),
    ("mechdesign.family",),
    ("mechdesign.questions.optimize",),
    ("mechdesign.drawing",),
    tuple(f"mechdesign.questions.{name}.figures" for name in COMMANDS),
    ("mechdesign.door.report",),
    ("mechdesign.experiments",),
    ("mechdesign.study.importing",),
    ("mechdesign.door",),
    ("mechdesign.door.exporting",),
    ("mechdesign.door.api",),
    ("mechdesign.door.reference",),
    ("mechdesign.door.cli",),
    ("mechdesign.__init__", "mechdesign.__main__"),
)  # fmt: skip
RANKS = {room: rank for rank, rooms in enumerate(ORDER) for room in rooms}


@cache
def imports() -> dict[str, set[str]]:
    """Every file with the files that it imports, by dotted names; a package is its `__init__`."""
    files = {".".join(("mechdesign", *p.relative_to(ROOT).with_suffix("").parts)): p for p in ROOT.rglob("*.py")}
    found: dict[str, set[str]] = {name: set() for name in files}
    for name, path in files.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for_types = {
            id(line)
            for node in ast.walk(tree)
            if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
            for line in node.body
        }
        for node in ast.walk(tree):
            if id(node) in for_types:
                continue
            wanted = []
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{path}: imports are written in full"
                wanted = [(f"{node.module}.{alias.name}", str(node.module)) for alias in node.names]
            elif isinstance(node, ast.Import):
                wanted = [(alias.name, alias.name) for alias in node.names]
            for candidates in wanted:
                names = [end for each in candidates for end in (each, f"{each}.__init__") if end in files]
                found[name].update(names[:1])
    return found


def packages(name: str) -> set[str]:
    """The `__init__` of every package around a file."""
    parts = name.removesuffix(".__init__").split(".")[:-1]
    return {".".join((*parts[: k + 1], "__init__")) for k in range(len(parts))}


def rank(name: str) -> int:
    """Where a file stands in `ORDER`, by the nearest folder that has a line."""
    while name not in RANKS:
        name = name.rpartition(".")[0]
    return RANKS[name]


def test_no_file_imports_itself_by_way_of_others():
    # A cycle raises an error that names its files. A file of another package runs the `__init__` of that as well.
    # The package itself imports a question's module when it is used.
    graph = {}
    for name, used in imports().items():
        entered = set().union(*(packages(other) for other in used)) - packages(name)
        graph[name] = (used | entered) - {name, "mechdesign.__init__"}
    TopologicalSorter(graph).prepare()


def test_folders_import_what_is_below_them():
    upwards = [
        f"{name} imports {other}"
        for name, used in imports().items()
        for other in used - {"mechdesign.__init__"}
        if rank(other) > rank(name)
    ]
    assert not upwards


def calls() -> list[ast.Call]:
    """Every warning that the package makes, of a pose too."""
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in ROOT.rglob("*.py"))
    nodes = (node for tree in trees for node in ast.walk(tree))
    makers = {"Caution", "Remark"}
    return [node for node in nodes if isinstance(node, ast.Call) and getattr(node.func, "id", "") in makers]


def test_every_warning_is_of_a_declared_kind_and_every_kind_has_a_warning_and_a_page():
    written = {node.args[0].value for node in calls() if node.args and isinstance(node.args[0], ast.Constant)}
    assert written == KINDS.keys()
    assert ALL not in KINDS
    docs = Path(__file__).parents[2] / "docs"
    made = "reference/study/index"
    assert [kind for kind, each in KINDS.items() if each.page != made and not (docs / f"{each.page}.md").exists()] == []

"""The rules that the code keeps: which way imports go, what a class may be, who may print."""

import ast
import importlib
import inspect
import pkgutil
from pathlib import Path
from types import ModuleType

import impactjax
from tiers import quick

pytestmark = quick

ROOT = Path(__file__).parent.parent
SOURCE = ROOT / "src" / "impactjax"
FILES = sorted(SOURCE.rglob("*.py"))
ORDER = [
    "_series",
    "_hybrid",
    "_model",
    "_mechanics",
    "_optimise",
    "_study",
    "_simulate",
    "_response",
    "_analytic",
    "_first_look",
    "_sensor",
    "_record",
    "_problem",
    "_fit",
    "_compare",
    "_check",
    "_identify",
    "_design",
    "_thesis",
    "_report",
    "_cli",
]
PUBLIC_FILES = ["io", "plot"]
GROUND = [
    "_types",
    "_known",
    "_results",
    "_abstract_code",
    "_outcome",
    "_number_format",
    "_parameter",
    "_refusal",
    "_shown",
    "_terminal",
]


def imports(path: Path) -> list[str]:
    """Full names of the modules that a file imports, also inside functions."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            found.append(node.module or "")
    return found


def modules() -> list[ModuleType]:
    walked = pkgutil.walk_packages(impactjax.__path__, "impactjax.")
    return [importlib.import_module(each.name) for each in walked if "__main__" not in each.name]


CLASSES = {
    each
    for module in modules()
    for each in vars(module).values()
    if inspect.isclass(each) and each.__module__ == module.__name__
}


def test_imports_go_one_way():
    for path in FILES:
        own = path.relative_to(SOURCE).parts[0].removesuffix(".py")
        if own in ("__init__", "__main__", *PUBLIC_FILES):
            continue
        allowed = {*GROUND, *ORDER[: ORDER.index(own) + 1]} if own in ORDER else {*GROUND}
        for module in imports(path):
            package, *rest = module.split(".")
            if own == "_thesis" and package == "impactjax":
                assert rest[:1] in ([], ["_thesis"]), f"{path} imports more than public names"
                continue
            assert package != "impactjax" or rest[0] in allowed, f"{path} imports {module}"


def test_only_public_names_of_others_are_imported():
    for path in FILES:
        for module in imports(path):
            package, *rest = module.split(".")
            private = package != "impactjax" and any(part.startswith("_") for part in rest)
            assert not private, f"{path} imports {module}"
            assert module != "equinox.internal", path


def test_only_the_command_and_the_display_of_progress_print():
    for path in FILES:
        if path.is_relative_to(SOURCE / "_cli") or path == SOURCE / "_terminal.py":
            continue
        nodes = list(ast.walk(ast.parse(path.read_text())))
        names = {node.id for node in nodes if isinstance(node, ast.Name)}
        parts = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
        packages = {module.split(".")[0] for module in imports(path)}
        assert not names & {"print", "input", "breakpoint"}, path
        assert not parts & {"stdout", "stderr", "callback"}, path
        assert not packages & {"logging", "warnings", "rich", "typer"}, path


def test_files_are_short():
    for path in [*FILES, *(ROOT / "tests").glob("*.py"), *(ROOT / "data").glob("*.py")]:
        assert len(path.read_text().splitlines()) <= 300, path


def test_no_shortcuts():
    for path in FILES:
        nodes = list(ast.walk(ast.parse(path.read_text())))
        names = {node.id for node in nodes if isinstance(node, ast.Name)}
        assert not names & {"super", "hasattr", "eval", "exec", "globals"}, path
        handlers = [node.type for node in nodes if isinstance(node, ast.ExceptHandler)]
        for caught in handlers:
            assert caught is not None, path
            wide = {each.id for each in ast.walk(caught) if isinstance(each, ast.Name)}
            assert not wide & {"Exception", "BaseException"}, path


def is_ours(each: type) -> bool:
    return each.__module__.split(".")[0] == "impactjax"


def is_called_abstract(each: type) -> bool:
    return each.__name__.startswith("Abstract") or each is impactjax.HybridSystem


def test_every_class_is_abstract_or_final():
    assert len(CLASSES) > 40
    for each in CLASSES:
        for base in each.__mro__[1:]:
            assert not is_ours(base) or is_called_abstract(base), (each, base)


def test_abstract_classes_are_called_so():
    for each in CLASSES:
        abstract = is_called_abstract(each)
        if inspect.isabstract(each):
            assert abstract, each
        if abstract:
            assert inspect.isabstract(each) or any(each in other.__bases__ for other in CLASSES)


PUBLIC = {
    name: getattr(impactjax, name)
    for name in dir(impactjax)
    if not name.startswith("_") and callable(getattr(impactjax, name))
}


def test_public_names_say_what_they_are():
    for name, value in PUBLIC.items():
        assert is_ours(value)
        assert value.__name__ == name
        text = vars(value)["__doc__"] if inspect.isclass(value) else value.__doc__
        assert text, name
        assert len(inspect.cleandoc(text).splitlines()[0]) > 15, name
        for own, member in vars(value).items() if inspect.isclass(value) else ():
            public = not own.startswith("_")
            if public and (inspect.isfunction(member) or isinstance(member, property)):
                assert inspect.getdoc(getattr(value, own)), f"{name}.{own}"


def test_arguments_of_public_verbs_are_explained():
    for name, value in PUBLIC.items():
        if inspect.isfunction(value) and len(inspect.signature(value).parameters) > 2:
            text = inspect.getdoc(value) or ""
            for argument in inspect.signature(value).parameters:
                assert f"`{argument}`" in text, f"{name} does not explain {argument}"


def test_every_module_says_what_it_is():
    for module in modules():
        if not module.__name__.split(".")[-1].startswith("_"):
            assert module.__doc__, module


OPENINGS = {"That", "Those", "Of", "What", "Whether", "Where", "Which", "How", "As", "If", "From"}


def docstrings(path: Path) -> list[str]:
    """Docstrings of a file, also those of attributes."""
    nodes = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Expr)]
    values = [node.value.value for node in nodes if isinstance(node.value, ast.Constant)]
    return [inspect.cleandoc(value) for value in values if isinstance(value, str)]


def test_docstrings_open_with_a_noun_or_verb_of_the_field():
    for path in [*FILES, *(ROOT / "tests").glob("*.py")]:
        for text in docstrings(path):
            first = text.split()[0].strip(",.:;")
            assert first not in OPENINGS, f"{path}: {text.splitlines()[0]}"
            assert not text.startswith("The one "), f"{path}: {text.splitlines()[0]}"

"""``{{ api MODULE }}`` in a page: a table of what a module offers, then functions; a class has its page.

A page says which module it is about, and nothing else: a new public name appears by itself.
"""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar, get_origin

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

# What several modules offer is shown once, on the page of the first of these.
ORDER = ("", "models.own", "models", "errors", "io", "observables", "reference", "studies", "theory")
CLASSES = "classes"
"""Folder of the pages of classes, which the build writes."""
REQUEST = re.compile(r"^\{\{ api (?P<module>[\w.]+) \}\}$", re.MULTILINE)


def public(module: ModuleType) -> dict[str, Any]:
    """Return the public names of a module: those of ``__all__``, else what it defines and documents."""
    if hasattr(module, "__all__"):
        names = list(module.__all__)
        found = {name: getattr(module, name) for name in names}
    else:
        found = {
            name: thing
            for name, thing in vars(module).items()
            if getattr(thing, "__module__", None) == module.__name__ and getattr(thing, "__doc__", None)
        }
    return {
        name: thing
        for name, thing in found.items()
        if not (inspect.ismodule(thing) or name.startswith("_") or isinstance(thing, TypeVar))
    }


def shown_on_page(module: ModuleType) -> dict[str, Any]:
    """Return what the page of a module shows: its names without those that an earlier page has."""
    rooms = [f"carom.{room}".rstrip(".") for room in ORDER]
    before = rooms[: rooms.index(module.__name__)] if module.__name__ in rooms else rooms
    elsewhere = [x for room in before for x in public(importlib.import_module(room)).values()]
    return {name: thing for name, thing in public(module).items() if not any(thing is x for x in elsewhere)}


def is_class(thing: Any) -> bool:
    """Tell whether a name has a page of its own: a class that is no error."""
    return inspect.isclass(thing) and not issubclass(thing, Exception)


def expanded(request: re.Match[str]) -> str:
    """Return the reStructuredText for one request, and the hidden list of the pages of its classes."""
    module = importlib.import_module(request["module"])
    names = shown_on_page(module)
    lines = ["```{eval-rst}"]
    # The module's own docstring, which also makes it a target of links.
    lines += [f".. automodule:: {module.__name__}", "", f".. currentmodule:: {module.__name__}", ""]
    documented = [name for name, x in names.items() if callable(x) and not get_origin(x)]
    lines += [".. autosummary::", "", *(f"   {name}" for name in documented)]
    classes = [name for name, thing in names.items() if is_class(thing)]
    if classes:
        lines += ["", ".. toctree::", "   :hidden:", ""]
        lines += [f"   {name} </{CLASSES}/{module.__name__}.{name}>" for name in classes]
    for name, thing in names.items():
        if name in classes:
            continue
        if hasattr(thing, "__metadata__"):  # the annotation of a field
            lines += ["", f".. py:data:: {name}", "", f"   {thing.__metadata__[0].text}"]
        elif get_origin(thing) or not callable(thing):  # its docstring would be that of the type behind it
            lines += ["", f".. py:data:: {name}", f"   :value: {thing!r}"]
        elif inspect.isclass(thing):
            lines += ["", f".. autoexception:: {name}", "   :show-inheritance:"]
        else:
            lines += ["", f".. autofunction:: {name}"]
    return "\n".join([*lines, "```"])


def class_page(module: str, name: str, thing: type) -> str:
    """Return the page of a class in Markdown."""
    lines = [f"# {name}", "", "```{eval-rst}", f".. currentmodule:: {module}", ""]
    lines += [f".. autoclass:: {name}", "   :members:"]
    if any(base.__module__.startswith("carom.") for base in thing.__bases__):
        lines += ["   :inherited-members: object, tuple, ABC"]
    return "\n".join([*lines, "```", ""])


def write_pages(app: Sphinx) -> None:
    """Write the page of each class; unchanged ones are not read again, and those of no class go."""
    wanted = {}
    for shelf in Path(app.srcdir).glob("api/*.md"):
        for request in REQUEST.finditer(shelf.read_text(encoding="utf-8")):
            module = importlib.import_module(request["module"])
            for name, thing in shown_on_page(module).items():
                if is_class(thing):
                    wanted[f"{module.__name__}.{name}.md"] = class_page(module.__name__, name, thing)
    folder = Path(app.srcdir) / CLASSES
    folder.mkdir(exist_ok=True)
    for path in folder.glob("*.md"):
        if path.name not in wanted:
            path.unlink()
    for file, text in wanted.items():
        path = folder / file
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def expand(app: Sphinx, docname: str, source: list[str]) -> None:
    """Replace every request in a page."""
    source[0] = REQUEST.sub(expanded, source[0])


def skip_fields(app: Sphinx, what: str, name: str, thing: Any, skip: bool, options: Any) -> bool | None:
    """Leave out the fields of a NamedTuple, which its own docstring explains."""
    return True if str(getattr(thing, "__doc__", "")).startswith("Alias for field number") else None


def plain_types(app: Sphinx, doctree: nodes.document) -> None:
    """Keep "(n, d) array" as it is: Sphinx would link its n to an attribute of that name."""
    for node in list(doctree.findall(addnodes.pending_xref)):
        if node["reftype"] == "class" and node["reftarget"].islower() and "." not in node["reftarget"]:
            node.replace_self(node.children)


def no_way_back(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Take "[docs]" out of the pages of sources: it leads to a module's own name, not to the public one."""
    if page.startswith("_modules/") and "body" in context:
        context["body"] = re.sub(r'<a class="viewcode-back".*?</a>', "", context["body"])


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("builder-inited", write_pages)
    app.connect("source-read", expand)
    app.connect("autodoc-skip-member", skip_fields)
    app.connect("doctree-read", plain_types)
    app.connect("html-page-context", no_way_back)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

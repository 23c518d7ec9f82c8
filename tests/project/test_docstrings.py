"""Docstrings of the public interface: complete, and in sentences that are read once.

The public names are those that the pages of ``docs/api`` show, with the methods and properties of their
classes. ``python tests/project/test_docstrings.py`` prints the words per sentence of each, and the
longest sentence.
"""

import ast
import functools
import importlib
import inspect
import itertools
import pkgutil
import re
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from helpers.sentences import sentences

import carom
from carom import errors
from carom.compiling.registry import Questions

ROOT = Path(__file__).parents[2]
# Words per sentence: the mean over a docstring, and the longest.
MEAN, LONGEST = 20.0, 40

NAMED = ("Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns")
SECTIONS = "|".join([*NAMED, "Notes", "Examples"])
OURS = {name for name in vars(errors) if name.endswith("Error")}

# Functions of carom.paths that raise FileError.
FILES = ("existing", "reading", "replacing", "writable", "write_text", "writing")

# A docstring may leave its parameters to another one: "Parameters and errors are those of :func:`x`."
ELSEWHERE = re.compile(r"[Pp]arameters\b[^.]* (?:those of|as for) :\w+:`|\bas for :\w+:`")


class Public(NamedTuple):
    """A public name: what it is, and the class that it belongs to."""

    name: str
    thing: Any
    owner: type | None

    @property
    def text(self) -> str:
        return inspect.cleandoc(self.thing.__doc__ or "")

    @property
    def arguments(self) -> list[str]:
        if inspect.isclass(self.thing) and (
            issubclass(self.thing, BaseException)
            or getattr(self.thing, "_is_protocol", False)
            or (issubclass(self.thing, Questions) and not getattr(self.thing, "_fields", ()))
        ):
            return []
        names = list(inspect.signature(self.thing).parameters)
        # A method that a class borrows from a function calls its instance by the name of its class.
        own = self.owner is not None and names and names[0] in ("self", "cls", "sim")
        return names[1:] if own else names


def behind(member: Any) -> Any:
    """Return the function of a method or a property."""
    if isinstance(member, property):
        return member.fget
    if isinstance(member, functools.cached_property):
        return member.func
    return getattr(member, "__func__", member)


@functools.cache
def public() -> tuple[Public, ...]:
    """Return every public name once."""
    asked = re.compile(r"^\{\{ api ([\w.]+)", re.MULTILINE)
    pages = [asked.findall(page.read_text(encoding="utf-8")) for page in ROOT.glob("docs/api/*.md")]
    found: dict[int, Public] = {}
    for module in map(importlib.import_module, sorted({name for page in pages for name in page})):
        own = [n for n, x in vars(module).items() if getattr(x, "__module__", None) == module.__name__]
        for name in getattr(module, "__all__", own):
            thing = getattr(module, name)
            if name.startswith("_") or not (inspect.isclass(thing) or inspect.isfunction(thing)):
                continue
            at = f"{thing.__module__}.{name}"
            found.setdefault(id(thing), Public(at, thing, None))
            for key, member in vars(thing).items() if inspect.isclass(thing) else ():
                function = behind(member)
                if not key.startswith("_") and inspect.isfunction(function):
                    found.setdefault(id(function), Public(f"{at}.{key}", function, thing))
    return tuple(found.values())


def section(text: str, heading: str) -> str:
    """Return a section of a docstring, or nothing."""
    found = re.search(rf"^{heading}\n-+\n(.*?)(?=^(?:{SECTIONS})\n-+\n|\Z)", text, re.MULTILINE | re.DOTALL)
    return found[1] if found else ""


def entries(text: str, heading: str) -> list[str]:
    """Return the names that a section explains."""
    lines = [line for line in section(text, heading).splitlines() if line and not line.startswith(" ")]
    return [name.strip().lstrip("*") for line in lines for name in line.split(" : ")[0].split(",")]


def passages(text: str) -> Iterator[str]:
    """Return paragraphs, entries of lists, and what sections say of each name; examples are no text."""
    text = text.replace(section(text, "Examples"), "")
    heading, current = "", []
    for line, after in itertools.pairwise([*text.splitlines(), "", ""]):
        if re.fullmatch("-{3,}", after):
            heading = line
        name = heading in NAMED and not line.startswith(" ")
        if not line.strip() or line == heading or re.fullmatch("-{3,}", line) or name or line[:2] == "- ":
            yield " ".join(current)
            current = [line[2:]] if line[:2] == "- " else []
        else:
            current.append(line.strip())
    yield " ".join(current)


def lengths(text: str) -> list[int]:
    """Return the number of words of every sentence of a docstring; a formula or a name in code is one."""
    text = re.sub(r"(?::[a-z:]+:)?`+[^`]*`+", "code", text)
    return [n for passage in passages(text) for n in sentences(passage)]


def fields(kind: type) -> list[str]:
    """Return the fields of a class that have a docstring of their own, below them."""
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    return [
        here.target.id
        for here, after in itertools.pairwise(definition.body)
        if isinstance(here, ast.AnnAssign)
        and isinstance(here.target, ast.Name)
        and isinstance(after, ast.Expr)
        and isinstance(getattr(after.value, "value", None), str)
    ]


@functools.cache
def shared(module: str) -> frozenset[str]:
    """Return the arguments that the docstring of a module explains for all of its functions."""
    text = inspect.cleandoc(importlib.import_module(module).__doc__ or "")
    lists = re.findall(r"^(\w+(?:, \w+)*) : .+$", text, re.MULTILINE)
    return frozenset(word for names in lists for word in names.split(", "))


def unexplained(x: Public) -> list[str]:
    """Return the arguments that a docstring does not explain, or explains in another order."""
    text, wanted = x.text, x.arguments
    if given := entries(text, "Parameters"):
        return [] if given == wanted else [f"{given}, not {wanted}"]
    if given := entries(text, "Attributes"):
        return [name for name in wanted if name not in given]
    if ELSEWHERE.search(text):
        return []
    known = shared(x.thing.__module__) | shared("carom.models.interfaces")
    if inspect.isclass(x.thing):
        return [name for name in wanted if name not in fields(x.thing) and f"``{name}``" not in text]
    return [name for name in wanted if name not in known and not re.search(rf"\b{name}\b", text)]


def raised(x: Public) -> set[str]:
    """Return the errors of Carom that a function, or the constructor of a class, raises itself."""
    functions = [x.thing]
    if inspect.isclass(x.thing):
        functions = [vars(x.thing)[name] for name in ("__init__", "__post_init__") if name in vars(x.thing)]
    found = set()
    for function in functions:
        if inspect.unwrap(function).__code__.co_filename.startswith("<"):  # written by dataclass
            continue
        for node in ast.walk(ast.parse(textwrap.dedent(inspect.getsource(function)))):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                found.add(getattr(node.exc.func, "id", getattr(node.exc.func, "attr", "")))
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                checked = getattr(node.func.value, "id", "") == "checks" and node.func.attr != "describe"
                found |= {"InputError"} if checked else set()
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in FILES:
                found.add("FileError")
    return found & OURS


def missing(find: Callable[[Public], object]) -> dict[str, object]:
    """Return what is found to be wrong, by name."""
    return {x.name: wrong for x in public() if (wrong := find(x))}


def test_every_public_name_begins_with_one_short_sentence():
    assert len(public()) > 600
    assert missing(lambda x: re.findall(r"^.*-{4,} \S.*$", x.text, re.MULTILINE)) == {}  # a lost heading

    def first(x: Public) -> str:
        summary = x.text.partition("\n\n")[0]
        plain = "\n" not in summary and summary.endswith(".") and len(lengths(summary)) <= 1
        return "" if plain else summary or "nothing"

    assert missing(first) == {}


def test_every_argument_is_explained_and_no_other():
    assert missing(unexplained) == {}


def test_every_error_is_named_where_it_is_raised():
    """By a function or method itself; or by its class, which says so: "From :meth:`update`, if ..."."""

    def hidden(x: Public) -> set[str]:
        of_class = section(inspect.getdoc(x.owner) or "", "Raises") if x.owner else ""
        elsewhere = f":meth:`{x.name.rpartition('.')[2]}`" in of_class or "errors are those of" in x.text
        return set() if elsewhere else {e for e in raised(x) if not re.search(rf"\b{e}\b", x.text)}

    assert missing(hidden) == {}


def test_what_returns_says_what():
    """In a section Returns or Yields, or in the first sentence: "Return ...", "Whether ..."."""

    face = {
        id(getattr(module, name))
        for module in (carom, carom.models, carom.io, carom.observables)
        for name in dir(module)
    }

    def silent(x: Public) -> bool:
        held = vars(x.owner)[x.name.rpartition(".")[2]] if x.owner else None
        value = isinstance(held, property | functools.cached_property)
        if id(x.owner or x.thing) not in face or not inspect.isfunction(x.thing) or value:
            return False
        (function,) = ast.parse(textwrap.dedent(inspect.getsource(x.thing))).body
        given = function.returns
        if given is None or (isinstance(given, ast.Constant) and given.value is None):
            return False
        first = x.text.partition("\n\n")[0]
        said = section(x.text, "Returns") or section(x.text, "Yields")
        return not said and not re.search(r"\b(return|yield|tell)s?\b", first, re.IGNORECASE)

    assert missing(silent) == {}


def test_every_name_of_the_package_has_an_example():
    """But errors, which are raised, and modules; ``tests/project/test_docs.py`` runs them."""
    names = [name for name in carom.__all__ if name not in vars(errors) and name != "Interrupted"]
    things = {name: getattr(carom, name) for name in names}
    assert [
        name
        for name, thing in things.items()
        if callable(thing) and not section(inspect.getdoc(thing) or "", "Examples")
    ] == []


def test_what_raises_is_an_error_or_a_warning():
    known = set(vars(errors)) | {"NoMeetingFound", "ValueError"}
    known |= {"Interrupted"}
    for heading in ("Raises", "Warns"):
        assert missing(lambda x, where=heading: set(entries(x.text, where)) - known) == {}


def test_sentences_of_docstrings_are_short():
    def long(x: Public) -> str:
        n = lengths(x.text)
        fine = not n or (sum(n) / len(n) <= MEAN and max(n) <= LONGEST)
        return "" if fine else f"{sum(n) / len(n):.1f} words a sentence, {max(n)} in the longest"

    assert missing(long) == {}


def test_every_room_says_what_lives_there_and_what_may_not():
    rooms = ["carom", *(m.name for m in pkgutil.walk_packages(carom.__path__, "carom.") if m.ispkg)]
    texts = {name: inspect.cleandoc(importlib.import_module(name).__doc__ or "") for name in rooms}
    assert [
        n for n, text in texts.items() if not re.search(r"\b([Nn]othing|[Nn]o|[Nn]ot|[Oo]nly)\b", text)
    ] == []


def test_the_test_sees_a_docstring_that_lies():
    def wrong(width, depth):
        """Return a well. It is deep

        Parameters
        ----------
        width : float
            One two three four. Five six seven.
        """
        raise errors.InputError(width, depth)

    x = Public("wrong", wrong, None)
    assert unexplained(x) == ["['width'], not ['width', 'depth']"]
    assert raised(x) == {"InputError"}
    assert lengths(x.text) == [3, 3, 4, 3]


if __name__ == "__main__":
    for x in public():
        words = lengths(x.text) or [0]
        print(f"{sum(words) / len(words):5.1f} {max(words):3d}  {x.name}")

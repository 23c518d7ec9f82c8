"""Names that do not exist, as keywords, keys and options: the one that is meant."""

from __future__ import annotations

import difflib
import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from carom.errors import InputError

C = TypeVar("C", bound=Callable[..., Any])

SAME = (
    ("eta", "packing_fraction", "phi", "fraction", "volume_fraction", "packing", "packing_fractions",
     "filling", "volfrac"),
    ("density", "rho", "number_density", "densities", "rho_star"),
    ("n", "N", "number", "particles", "spheres", "count", "size", "num", "num_particles", "n_particles",
     "natoms", "n_atoms", "num_atoms", "npart", "nparticles"),
    ("dimension", "k", "d", "dim", "dims", "dimensions", "ndim", "n_dim"),
    ("diameter", "sigma", "diameters"),
    ("mass", "m", "masses"),
    ("box", "L", "box_size", "edges", "lengths", "cell", "box_length", "boxlength", "lx"),
    ("positions", "pos", "coordinates", "coords", "xyz"),
    ("velocities", "vel", "momenta"),
    ("species", "types", "type", "typeid", "symbols", "numbers", "elements"),
    ("periodic", "pbc", "boundary"),
    ("restitution", "elasticity", "coefficient_of_restitution", "cor", "e"),
    ("pressure", "P", "barostat"),
    ("interaction", "potential", "pair_style"),
    ("lattice", "initial", "structure"),
    ("walls", "wall", "boundaries"),
    ("kT", "T", "temperature", "temp", "kBT", "T_init"),
    ("drive", "thermostat"),
    ("cores", "workers", "threads", "processes", "jobs", "cpus", "nproc", "n_jobs"),
    ("tries", "seeds"),
    ("seed", "random_seed", "first", "rng", "random_state"),
    ("out", "output", "folder", "directory", "dir", "target_folder"),
    ("overwrite", "force", "f", "replace", "clobber"),
    ("quiet", "silent", "no_progress"),
    ("walltime", "max_walltime", "time_limit", "hours", "seconds"),
    ("collisions_per_particle", "collisions", "length", "steps", "nsteps", "n_steps", "events"),
    ("timestep", "dt", "time_step"),
    ("relative_error", "target", "error", "accuracy", "precision", "tolerance"),
    ("dry_run", "explain", "dryrun"),
    ("until_Z", "until_pressure"),
    ("pictures", "png", "plot", "plots"),
    ("resume", "continue", "restart"),
    ("rmax", "r_max", "range", "cutoff"),
    ("color", "color_by"),
    ("rate", "shear_rate", "growth_rate"),
)  # fmt: skip
"""Words for the same thing: here and there in Carom, in other programs, in formulas and in older versions."""

FIRST = tuple(group[0] for group in SAME)
"""One word for each thing."""

NOWHERE = {
    "timestep": "there is none, as events are computed: time or collisions say how long",
    "ensemble": "volume and energy are kept; a drive keeps a temperature, a barostat a pressure",
}
"""Words of other programs for what has no name here."""

NO_KEYWORDS = {"self", "cls", "keywords", "unknown"}  # parameters that nobody gives by name

ALIKE = 0.65  # how alike two names are at least, where one is meant for the other
SPELT = 0.85  # how alike they are at least, where one is another in spite of a word for the same thing


def synonym(name: str, known: Iterable[str]) -> str | None:
    """Return the known name for the same thing, or None; options of the command line have their hyphens."""
    plain = {one.lstrip("-").replace("-", "_"): one for one in known if one != name}
    word = name.lstrip("-").replace("-", "_")
    same = [one for group in SAME if {word, word.lower()} & {*group} for one in group]
    same += [one for one in plain if one.lower() == word.lower()]
    return next((plain[one] for one in same if one in plain), None)


def named(name: str, known: Iterable[str]) -> str | None:
    """Return the name itself if it is known, else the known one for the same thing, or None."""
    return name if name in known else synonym(name, known)


def nearest(name: str, known: Iterable[str], alike: float = ALIKE) -> str | None:
    """Return the known name that is spelt most alike, or None."""
    names = {each.lower(): each for each in sorted(known)}
    near = difflib.get_close_matches(name[:80].lower(), names, n=1, cutoff=alike)
    return names[near[0]] if near else None


def suggestion(
    name: str,
    known: Iterable[str],
    *,
    listed: bool = False,
    gone: Mapping[str, str] | None = None,
    called: Mapping[str, str] | None = None,
    elsewhere: Mapping[str, str] | None = None,
) -> str:
    """Return the end of an error about an unknown name: the name that is meant, or all unless ``listed``.

    ``gone`` has what to do instead of some names, ``called`` what they are called here, ``elsewhere`` names
    that others know, and who.
    """
    names, others, gone = sorted({*known} - NO_KEYWORDS), elsewhere or {}, gone or {}
    if name in gone:
        return f"; {gone[name]}"
    if called and (one := named(name, called)):
        return f"; it is called {called[one]}"
    if one := synonym(name, names):
        return f"; it is called {one}"
    if one := synonym(name, gone):
        return f"; {gone[one]}"
    if one := nearest(name, names, SPELT):
        return f"; did you mean {one}"
    if one := named(name, others):
        return f"; {one} is a keyword of {others[one]}"
    if one := named(name, NOWHERE):
        return f"; {NOWHERE[one]}"
    if one := nearest(name, [*names, *others, *gone]):
        where = "" if one in names else f", a keyword of {others[one]}" if one in others else f"; {gone[one]}"
        return f"; did you mean {one}{where}"
    known = f" (known: {', '.join(names)})" if names else "; it takes none"
    return "" if listed else known


def refuse_unknown(
    maker: str,
    given: Iterable[str],
    known: Iterable[str],
    called: Mapping[str, str] | None = None,
    elsewhere: Mapping[str, str] | None = None,
) -> None:
    """Raise InputError if there is a keyword that ``maker`` does not know, with the one that is meant."""
    names = tuple(known)
    for name in given:
        if name not in names:
            hint = suggestion(name, names, called=called, elsewhere=elsewhere)
            raise InputError(f"{maker} has no keyword {name!r}{hint}.")


def corrected(
    called: Mapping[str, str] | None = None, elsewhere: Mapping[str, str] | None = None
) -> Callable[[C], C]:
    """Let a function or class refuse a keyword that it does not have by an InputError with the one meant."""

    def decorate(function: Any) -> Any:
        if isinstance(function, type):
            function.__init__ = decorate(function.__init__)  # type: ignore[misc]
            return function
        maker, _, name = function.__qualname__.rpartition(".")
        who = maker if name == "__init__" else f"{name}()"
        known = inspect.signature(function).parameters
        kinds = [each.kind for each in known.values()]
        by_name = inspect.Parameter.KEYWORD_ONLY in kinds and inspect.Parameter.VAR_POSITIONAL not in kinds
        most = kinds.count(inspect.Parameter.POSITIONAL_OR_KEYWORD)

        @functools.wraps(function)
        def checked(*args: Any, **kwargs: Any) -> Any:
            refuse_unknown(who, kwargs, known, called, elsewhere)
            if by_name and len(args) > most:
                names = ", ".join(f"{each}=" for each in [*known][most:])
                raise InputError(f"{who} takes {names}; found {args[most]!r:.40} without a keyword.")
            return function(*args, **kwargs)

        return checked

    return decorate

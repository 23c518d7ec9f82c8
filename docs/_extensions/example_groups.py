"""The examples: their titles, by group, and their pictures that are committed."""

from __future__ import annotations

import re
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"
IMAGES = Path(__file__).parents[1] / "images"
THUMBNAILS = IMAGES / "cards"
SUFFIXES = (".gif", ".png", ".webp")
GROUPS = {
    "Fluids and crystals": {
        "fluid_in_ten_lines": "A fluid in ten lines",
        "equation_of_state": "The equation of state of hard spheres",
        "finite_size": "How many particles are enough",
        "crystal": "An fcc crystal",
        "square_well": "Square wells: drops and a chain",
        "depletion": "Depletion: two big disks among small ones",
        "transport": "Transport coefficients and the long-time tail",
    },
    "Melting and freezing": {
        "melting_of_disks": "Melting of hard disks",
        "order_of_disks": "The order of disks that melt",
        "freezing_of_spheres": "Freezing of hard spheres",
        "constant_pressure": "Hard spheres at constant pressure",
    },
    "Packings and spherical codes": {
        "disks_27": "27 disks that jam",
        "disks_2000": "2000 disks: grains, bonds and rattlers",
        "caps_on_a_sphere": "Caps on a sphere",
    },
    "Billiards and obstacles": {
        "billiard_break": "The break of a billiard game",
        "billiards": "Four billiard tables",
        "lorentz_gas": "A Lorentz gas",
        "four_balls": "The algorithm on four balls",
        "cushions_160": "160 disks between cushions",
    },
    "Gravity and grains": {
        "barometric_column": "A column of disks in a field",
        "falling_bodies": "Bodies of several spheres over a floor",
        "shaken_ball": "A ball on a shaken floor",
        "rosato_bed": "A vibrated bed",
        "brazil_nut": "The Brazil-nut effect",
        "haffs_law": "Haff's law of cooling",
    },
    "Driven and glassy systems": {
        "sheared_spheres": "Sheared grains, smooth and rough",
        "oscillating_shear": "Moduli of an oscillating shear",
        "brownian_spheres": "Brownian spheres",
        "active_disks": "Active disks",
        "swap_liquid": "A dense liquid with swaps",
        "glassy_relaxation": "Relaxation times of a dense liquid",
    },
    "Rules": {"two_armies": "Two armies"},
    "Recipes": {
        "export_ovito_ase": "One run for several programs",
        "rdf_mdanalysis": "g(r) of a file with MDAnalysis",
        "restart": "Stop, save and continue",
        "bad_input_tour": "What Carom refuses",
        "replica_exchange": "Replica exchange",
        "study_on_a_cluster": "A study on a cluster",
    },
}
"""The examples with their titles, by group, in reading order. Recipes have no picture."""


def pictures(name: str) -> list[Path]:
    """Return the committed pictures of an example, the one that moves first."""
    wanted = name.replace("_", "-")
    found = [path for path in IMAGES.glob("*") if path.suffix in SUFFIXES and not path.stem.endswith("-dark")]
    return sorted(
        (path for path in found if re.fullmatch(rf"{wanted}(-.*)?", path.stem)),
        key=lambda path: (path.suffix != ".gif", path.stem),
    )


def others(name: str) -> set[str]:
    """Return the names of examples that begin with this one's: their pictures are not its own."""
    return {path.stem for path in EXAMPLES.glob("*.py") if path.stem.startswith(f"{name}_")}


def own_pictures(name: str) -> list[Path]:
    """Return the pictures of an example without those of an example with a longer name."""
    taken = {picture for other in others(name) for picture in pictures(other)}
    return [picture for picture in pictures(name) if picture not in taken]

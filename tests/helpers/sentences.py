"""Sentences of a paragraph and their words."""

import re

ABBREVIATIONS = (
    r"\b(?:e\.g|i\.e|et al|eqs?|[Ss]ec|Figs?|Phys|Rev|Lett|Comput|Chem|Mol|Appl|Mech|Oper|Res|cf|[A-Z])\."
)


def sentences(paragraph: str) -> list[int]:
    """Return the number of words of each sentence; a piece of code or a formula is one word."""
    plain = re.sub(r"`[^`]*`|\$[^$]*\$", "code", paragraph)
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", plain)
    plain = re.sub(ABBREVIATIONS, "X", plain)
    counts = [len(part.split()) for part in re.split(r"(?<=[.!?])[)\"*]*\s+", plain)]
    return [count for count in counts if count > 2]

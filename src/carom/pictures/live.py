"""What a notebook shows of a run while it runs: its numbers, and a small picture."""

from __future__ import annotations

import base64
import io
from typing import TYPE_CHECKING, Any

from carom import notebook
from carom.simulation.files.csv_log import Numbers, columns_of
from carom.table import in_html
from carom.texts import counted

if TYPE_CHECKING:
    from carom.simulation.simulation import Simulation

DPI = 50
"""A picture of 300 pixels."""


class Live:
    """What a notebook's cell shows while a run calls it; outside of notebooks it does nothing.

    Parameters
    ----------
    picture : bool
        Whether there is a picture of the particles beside the numbers.

    Notes
    -----
    The numbers are those of :class:`carom.CSVLog`. A picture of many spheres takes longer than some runs: let
    the interval at which a run calls this be long.

    Examples
    --------
    >>> import carom
    >>> sim = carom.Simulation(carom.Scene.random(100, 0.3, 2))
    >>> block = sim.run(time=10.0, every=2.0, call=carom.Live())
    """

    def __init__(self, *, picture: bool = True):
        self._picture = picture
        self._numbers = Numbers()
        self._shown: Any = None

    def __call__(self, sim: Simulation) -> None:
        """Show what the run has now, in the place of what it had."""
        if not notebook.in_notebook():
            return
        from IPython.display import HTML, display

        page = HTML(self.html(sim))
        if self._shown is None:
            self._shown = display(page, display_id=True)
        else:
            self._shown.update(page)

    def html(self, sim: Simulation) -> str:
        """Return what is shown, as HTML.

        Parameters
        ----------
        sim : Simulation
            The run; Z is that of the time since it was last shown.
        """
        found = self._numbers(sim, columns_of(sim))
        rows = [(name, "" if value is None else f"{value:.6g}") for name, value in found.items()]
        table = in_html(counted(sim.n, "particle"), rows)
        if not self._picture:
            return table
        return f'<div style="display:flex;gap:1em">{table}{_image(sim)}</div>'


def _image(sim: Simulation) -> str:
    from carom.pictures import plots
    from carom.scene.fields import standing

    file = io.BytesIO()
    plots.snapshot(sim.frame(), obstacles=standing(sim.scene)).savefig(file, dpi=DPI)
    return (
        f'<img alt="the particles" src="data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}">'
    )

"""Authority: Richardson extrapolation needs grids of one ratio (ITTC 7.5-03-01-01, 2008), in cells and on the walls."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ident.cfd.grids import GRIDS, box, refinement_bands


def template(cells: float, levels: int, extent: float, refinement: float) -> SimpleNamespace:
    """What the domain reads of a template."""
    grid = {"cells_per_length": cells, "levels": levels, "extent": extent, "refinement": refinement}
    return SimpleNamespace(grid=SimpleNamespace(**grid))


@settings(max_examples=50, deadline=None)
@given(
    st.floats(20, 200), st.integers(1, 6), st.floats(0.8, 6.0), st.floats(1.1, 2.0), st.sampled_from((None, -0.3, -9.0))
)
def test_cells_have_the_stated_ratio_on_every_grid(cells, levels, extent, refinement, surface_z):
    body = SimpleNamespace(vertices=np.array([[-2.0, -0.4, -0.2], [2.0, 0.4, 0.4]]))
    rule = template(cells, levels, extent, refinement)
    sizes = []
    for grid in GRIDS:
        domain = box(rule, body, 4.0, grid, surface_z)
        size = (np.array(domain.high) - domain.low) / domain.cells
        assert size == pytest.approx(np.full(3, size[0]))
        assert size[0] == pytest.approx(4.0 / cells * 2**levels * refinement ** GRIDS.index(grid))
        assert domain.high[0] >= 4.0 * extent * (1 - 1e-9)
        assert domain.high[0] < 4.0 * extent + size[0] * (1 + 1e-9)
        if surface_z is not None:
            assert domain.low[2] == surface_z
        sizes.append(size[0])
    assert sizes[1] / sizes[0] == pytest.approx(sizes[2] / sizes[1])


@given(st.integers(1, 10), st.floats(1e-3, 1.0), st.floats(1e-3, 10.0))
def test_cells_that_a_wall_passes_through_are_refined_to_the_walls_level(levels, wall, near):
    bands = refinement_bands(levels, wall, near)
    assert [level for _, level in bands] == list(range(levels, 0, -1))
    assert np.all(np.diff([distance for distance, _ in bands]) > 0.0)
    for distance, level in bands:
        halved = wall * 2.0 ** (levels - level + 1)
        assert distance >= 0.5 * math.sqrt(3.0) * halved

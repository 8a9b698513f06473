"""Places of the state vector: velocities and rates in the boat's axes, position and attitude on the earth."""

from __future__ import annotations

from sim.boat.catalogue import STATES

N_STATES = len(STATES)
U, V, W, P, Q, R, X, Y, Z, PHI, THETA, PSI = range(N_STATES)

"""A hanging chain on several ranks: mpiexec -n 2 python3 chain.py [-links 40]

Every rank describes the same scene; METIS divides the bodies. Channels and snapshots are the same on all ranks. In equilibrium the chain is a
catenary of straight links: its tension along x is the same in all of them.
"""

import sys

import petsc4py

if __name__ == "__main__":
    petsc4py.init(sys.argv)
from petsc4py import PETSc

import numpy as np

import hhtdae


def main(links=20):
    comm, length, mass = PETSc.COMM_WORLD, 1. / links, 2. / links
    scene = hhtdae.Scene(gravity=(0, -9.81, 0))
    pins, middles, before = [], [], scene.ground
    for k in range(links):
        link = scene.rigid_body("link %d" % k, mass=mass, inertia=hhtdae.inertia.cylinder(mass, 0.005, length), position=((k + 0.5) * length, 0, 0))
        pins.append(scene.connect("pin %d" % k, hhtdae.Revolute, link, before, (k * length, 0, 0)))
        middles.append(link.marker())
        before = link
    end = link.marker((length / 2, 0, 0))
    scene.add("pull", hhtdae.UserForce(end, force=[30., 0, 0]))
    scene.channel("end", hhtdae.displacement(end, "y"), "m")
    now = scene.run().equilibrium().snapshot()
    sag = now.motion(end).position[1]
    tension = np.array([now.load(pin, middle).force for pin, middle in zip(pins, middles)])
    weights = mass * 9.81 * np.arange(links, 0, -1)
    y = -length * np.sum((weights - weights[-1] / 2) / np.hypot(weights - weights[-1] / 2, 30))
    run = scene.solve(0.5, tolerance=1e-5)
    PETSc.Sys.Print("%d ranks: the end hangs %.9f m below the first pin, exact %.9f m" % (comm.size, -sag, -y))
    PETSc.Sys.Print("let go from the horizontal it is at %.6f m after 0.5 s" % run["end"][-1])
    return sag - y, abs(tension[:, 0] + 30).max(), run["end"][-1]


if __name__ == "__main__":
    main(PETSc.Options().getInt("links", 20))

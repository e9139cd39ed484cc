"""Forces, variables and states as formulas, which are written in Python and run in C++.

A mass on a stiffening spring, F = k x + c x^3, with a damper whose characteristic was measured at a few points; a state integrates the work
done on the damper. Energy at the start = energy now + this work.
"""

import hhtdae


def main():
    k, c, m = 400., 5e4, 1.5
    damper = hhtdae.spline([-2, -0.5, -0.1, 0, 0.1, 0.5, 2], [-14, -8, -3, 0, 2, 5, 9])  # N over m/s: harder in rebound
    scene = hhtdae.Scene()
    mass = scene.add("mass", hhtdae.PointMass(m, position=(0.1, 0, 0)))
    at = mass.marker()
    x, v = hhtdae.displacement(at, "x"), hhtdae.velocity(at, "x")
    drag = damper(v)
    scene.add("spring", hhtdae.UserForce(at, force=[-k * x - c * x**3 - hhtdae.where(hhtdae.time() > 0.2, drag, 0.), 0, 0]))
    work = scene.state("work", rate=hhtdae.where(hhtdae.time() > 0.2, drag * v, 0.), initial=0)
    energy = 0.5 * m * v**2 + 0.5 * k * x**2 + 0.25 * c * x**4
    scene.channel("x", x, "m")
    scene.channel("energy", energy, "J")
    scene.channel("balance", energy + hhtdae.value(work), "J")
    run = scene.solve(2, tolerance=1e-8)
    balance = run["balance"]
    print("energy: %.4f J at the start, %.4f J at the end, %.4f J went into the damper" % (run["energy"][0], run["energy"][-1], balance[-1] - run["energy"][-1]))
    print("the balance is off by %.1e J at most" % abs(balance - balance[0]).max())
    return abs(balance - balance[0]).max(), run["energy"][-1]


if __name__ == "__main__":
    main()

"""Optimization with SciPy: the damping with which a mass on a spring comes to rest soonest.

The integral of the squared displacement after a push, J = int x^2 dt from x = 0 at unit speed, with m = k = 1, is 1 / (4 z) for the damping ratio z.
With a cost of the damper's force, J + int (2 z x')^2 dt = 1 / (4 z) + z, the best ratio is 1/2.
"""

import hhtdae


def scene():
    s = hhtdae.Scene()
    ratio = s.parameter("ratio", 1.)
    mass = s.add("mass", hhtdae.PointMass(1, velocity=(1, 0, 0)))
    at = mass.marker()
    x, v = hhtdae.displacement(at, "x"), hhtdae.velocity(at, "x")
    s.add("spring", hhtdae.UserForce(at, force=[-x - 2 * ratio * v, 0, 0]))
    cost = s.state("cost", rate=x**2 + (2 * ratio * v)**2, initial=0)
    s.channel("cost", hhtdae.value(cost))
    return s


def main():
    from scipy.optimize import minimize_scalar

    s, tried = scene(), []

    def cost(ratio):
        s.set(ratio=ratio)
        with s.run(tolerance=1e-7, sample=60) as run:
            value = run.solve(60)["cost"][-1]
        tried.append((ratio, value))
        print("damping ratio %.5f: cost %.6f, exact %.6f" % (ratio, value, 1 / (4 * ratio) + ratio))
        return value

    best = minimize_scalar(cost, bounds=(0.2, 2), method="bounded", options={"xatol": 1e-3})
    print("best ratio %.4f, exact 0.5" % best.x)
    return best.x, max(abs(value - 1 / (4 * r) - r) for r, value in tried)


if __name__ == "__main__":
    main()

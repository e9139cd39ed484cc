"""What Python costs a run: the chain of examples/chain.cpp and the same one from Python, in turn; counts and the median of the ratios of processor time. Then
equations of motion that call Python beside the same ones traced.

usage: overhead.py build/bin/chain [pairs], with the package's directory in PYTHONPATH
"""

import os
import re
import statistics
import subprocess
import sys

N, END = 10, 5


def chain():
    import petsc4py
    petsc4py.init(["overhead"])
    import hhtdae as h

    scene = h.Scene(gravity=(0, -9.81, 0))
    last = scene.ground.marker()
    for k in range(N):
        rod = scene.rigid_body("", inertia=(1e-3, 1 / 12, 1 / 12), position=(k + 0.5, 0, 0))
        scene.add("", h.Revolute(rod.marker((-0.5, 0, 0)), last))
        last = rod.marker((0.5, 0, 0))
    for name, component in zip("xyz", range(3)):
        scene.channel("tip." + name, h.displacement(last, component), "m")
    scene.channel("kinetic", h.kinetic_energy(), "J")
    scene.channel("potential", h.potential_energy(), "J")
    run = scene.solve(END, tolerance=1e-4, sample=END / 10)
    s = run.statistics
    print("summary: steps=%d rejected=%d newton=%d residuals=%d jacobians=%d factorizations=%d solves=%d cpu=%.6g" % (
        s.steps, s.rejected, s.newton, s.residuals, s.jacobians, s.factorizations, s.solves, s.cpu))
    print("tip: x=%.12g" % run["tip.x"][-1])


def pendulum(pairs):
    import time

    import hhtdae as h

    took = {False: [], True: []}
    for _ in range(pairs):
        for trace in took:
            begun = time.process_time()
            s = h.solve_mechanism(lambda t, q, v, a: [a[0], a[1] + 9.81], (0, 2), [1, 0], [0, 0], constraints=lambda t, q: [q[0]**2 + q[1]**2 - 1], trace=trace)
            took[trace].append(1e3 * (time.process_time() - begun))
    print("pendulum by solve_mechanism, %d steps: %.1f ms calling Python, %.1f ms traced" % (s.statistics.steps, *map(statistics.median, took.values())))


def counts(command):
    text = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, "OMP_NUM_THREADS": "1"}).stdout
    words = dict(re.findall(r"(\w+)=(\S+)", text))
    return {k: int(words[k]) for k in ("steps", "rejected", "newton", "residuals", "jacobians", "factorizations", "solves")}, float(words["cpu"]), words["x"]


def main(program, pairs):
    ratios = []
    for _ in range(pairs):
        cpp, cpp_time, cpp_x = counts([program, "-n", str(N), "-end", str(END)])
        python, python_time, python_x = counts([sys.executable, "-B", os.path.abspath(__file__), "run"])
        ratios.append(python_time / cpp_time)
    print("C++    ", cpp, "x =", cpp_x)
    print("Python ", python, "x =", python_x)
    print("processor time of the steps, Python / C++: median %.3f, from %.3f to %.3f" % (statistics.median(ratios), min(ratios), max(ratios)))
    pendulum(pairs)


if __name__ == "__main__":
    if sys.argv[1] == "run":
        chain()
    else:
        main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 11)

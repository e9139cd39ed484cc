"""Operations, messages, bytes and reductions of a rank in a step of a whole finite-element body, counted by PETSc on ranks that
may share processors; a model of them by volume and surface of a rank's part; what it says of 10^7 and 10^8 unknowns.

usage: scaling.py BUILD/bin/fullbody [--strong 10,10,10] [--weak 6,6,6/12,6,6/12,12,6/12,12,12] [--ranks 1,2,4,8] [--steps 2] [--mpiexec mpiexec]
                  [--iterations 25] [--corrections 5] [--folder .]

--strong: one body on each number of --ranks; --weak: one body for each number of ranks. Each run is
    fullbody -size ... -held clamp -law large -steps 2 -ksp_type cg -pc_type hhtconstraint -log_view :log.py:ascii_info_detail
and only its stage "Further steps" counts. Everything is taken in units of one product with the matrix, of which one iteration of the
linear solver has one. Counts depend on the partition alone, not on what else the machine does. Not counted: the elements' operations, and
what MUMPS sends if it is the solver on a coarser level. --iterations of the linear solver for each of --corrections a step: what the extrapolation assumes.
"""

import argparse
import collections
import math
import os
import re

from bench_tools import run, table

# What the extrapolation assumes
MEMORY = 4e9  # bytes/s of a rank, with all ranks of a node at work
LATENCY = 2e-6  # s a message, and for each doubling of the ranks in a reduction
NETWORK = 1e9  # bytes/s of a rank
NEIGHBOURS = 26  # of a rank, one message each way in a product
ROW = 176  # entries of a row of a large body of bricks with 20 nodes
ENTRY = 40 / 18  # bytes that a product moves for each entry of the matrix: a block of nine in single precision and its column, for both of a symmetric pair
WORK = 10 * 8 * 2  # bytes of vectors for each unknown and iteration: ten vectors read and written
FORCE = 2.1e-6 / 12  # s of an evaluation for each unknown: fekernels, 12 unknowns a brick
COARSE = 200  # unknowns for one of the coarse level: 400 nodes an aggregate
SOLVE, SOLVED = 0.155, 119898  # s of one solve by MUMPS on one rank with so many unknowns (src/linear/README.md); it grows with the power 4/3


def count(path):
    """Of the ranks' steps after the first, for each product: largest and mean operations, largest messages, bytes and reductions"""
    tree = lambda: collections.defaultdict(tree)
    names = {"tree": tree}
    with open(path) as file:  # PETSc writes Python; versions from 3.22 on leave out that an event has entries
        exec(compile(file.read().replace("= {}", "= tree()"), path, "exec"), names)
    events = names["Stages"]["Further steps"]
    step, products = events["TSStep"], events["MatMult"][0]["count"]
    of = lambda what: [step[r][what] / products for r in range(len(step))]
    flops = of("flop")
    return {"flops": max(flops), "mean": sum(flops) / len(flops), "messages": max(of("numMessages")), "bytes": max(of("messageLength")),
            "reductions": max(of("numReductions"))}


def measure(a, size, ranks):
    folder = os.path.abspath(a.folder)
    log = os.path.join(folder, "log.py")
    command = a.mpiexec.split() + ["-n", ranks, os.path.abspath(a.program), "-size", size, "-held", "clamp", "-law", "large", "-steps", a.steps,
                                   "-ksp_type", "cg", "-pc_type", "hhtconstraint", "-log_view", ":%s:ascii_info_detail" % log]
    text = run(command, folder=folder, OMPI_MCA_rmaps_base_oversubscribe="1", OMPI_MCA_mpi_yield_when_idle="1", OMPI_ALLOW_RUN_AS_ROOT="1",
               OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")[0]
    k = count(log)
    os.remove(log)
    k.update(ranks=ranks, size=size, unknowns=int(re.search(r"(\d+) unknowns", text).group(1)),
             iterations=float(re.search(r"per solve (\S+);", text).group(1)), memory=float(re.search(r"at most (\d+) MB", text).group(1)))
    k["own"] = k["unknowns"] / ranks
    return k


def fit(rows, value, basis):
    """Least squares of relative errors for one or two functions of a row: coefficients, largest relative error"""
    columns = [[f(r) / value(r) for r in rows] for f in basis]
    dot = lambda x, y: sum(p * q for p, q in zip(x, y))
    if len(basis) == 1:
        c = [sum(columns[0]) / dot(columns[0], columns[0])]
    else:
        (aa, ab, bb), (ra, rb) = (dot(columns[0], columns[0]), dot(columns[0], columns[1]), dot(columns[1], columns[1])), map(sum, columns)
        det = aa * bb - ab * ab
        c = [(ra * bb - rb * ab) / det, (rb * aa - ra * ab) / det]
    return c, max(abs(sum(k * col[i] for k, col in zip(c, columns)) - 1) for i in range(len(rows)))


def model(rows, iterations, corrections):
    own = lambda r: r["own"]
    several = [r for r in rows if r["ranks"] > 1]
    (volume,), off = fit(rows, lambda r: r["flops"], [own])
    (kept, shared), off_memory = fit(rows, lambda r: r["memory"], [own, lambda r: 1.0])
    border = max(r["bytes"] / own(r) ** (2 / 3) for r in several)  # of a part with neighbours on all sides, as most are among many
    messages, reductions = max(r["messages"] for r in several), max(r["reductions"] for r in several)
    print("\nn unknowns a rank, one iteration: %.0f n operations (off by at most %.0f %%), at most %.0f n^(2/3) bytes, %.0f messages and %.1f reductions; memory "
          "%.0f MB + %.1f kB n (%.0f %%)" % (volume, 100 * off, border, messages, reductions, shared, 1e3 * kept, 100 * off_memory))
    result = []
    solves = iterations * corrections
    for unknowns, ranks in ((1e6, 16), (1e7, 16), (1e7, 256), (1e8, 256), (1e8, 4096)):
        n = unknowns / ranks
        moved, sent = n * (ENTRY * ROW + WORK), border * n ** (2 / 3)
        result.append(["%.0e" % unknowns, ranks, "%.2g" % (solves * volume * n), "%.2g" % (solves * moved), "%.2g" % (solves * sent),
                       "%.2g" % (solves * moved / MEMORY), "%.2g" % (corrections * n * FORCE), "%.2g" % (solves * (2 * NEIGHBOURS * LATENCY + sent / NETWORK)),
                       "%.2g" % (solves * reductions * math.log2(ranks) * LATENCY), "%.2g" % (solves * SOLVE * (unknowns / COARSE / SOLVED) ** (4 / 3)),
                       "%.2g" % (1e-3 * (shared + kept * n))])
    print()
    table(["unknowns", "ranks", "operations", "bytes of memory", "bytes sent", "s: memory", "elements", "messages", "reductions", "coarse level on one rank",
           "GB a rank"], result)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("program")
    p.add_argument("--strong", default="10,10,10")
    p.add_argument("--weak", default="6,6,6/12,6,6/12,12,6/12,12,12")
    p.add_argument("--ranks", default="1,2,4,8")
    p.add_argument("--steps", type=int, default=2)
    p.add_argument("--mpiexec", default="mpiexec")
    p.add_argument("--iterations", type=float, default=25)
    p.add_argument("--corrections", type=float, default=5)
    p.add_argument("--folder", default=".")
    a = p.parse_args()
    ranks = [int(x) for x in a.ranks.split(",")]
    cases = [(a.strong, r) for r in ranks] + list(zip(a.weak.split("/"), ranks) if a.weak else [])
    rows = [measure(a, size, r) for size, r in cases]
    table(["ranks", "size", "unknowns", "iterations a solve", "operations of a rank, most", "mean", "messages", "bytes", "reductions", "MB"],
          [[r["ranks"], r["size"], r["unknowns"], r["iterations"], "%.3g" % r["flops"], "%.3g" % r["mean"], "%.1f" % r["messages"], "%.3g" % r["bytes"],
            "%.1f" % r["reductions"], "%.0f" % r["memory"]] for r in rows])
    model(rows, a.iterations, a.corrections)


if __name__ == "__main__":
    main()

"""Runs that are killed at random moments (kill -9, one rank or all), resumed from their last checkpoint until they end: the last state,
the counters and the recorded results are those of a run that nobody disturbed, bit for bit.

usage: kill9.py BIN DIRECTORY COUNT [SEED]
"""

import os
import random
import signal
import subprocess
import sys
import time

from common import check, run, surroundings
from resuming import command, content, states, summary

bin, directory, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
os.makedirs(directory, exist_ok=True)
chance = random.Random(seed)

# Name, options, whether it is a scene, numbers of ranks
RUNS = [
    ("andrews", ["-ts_rtol", "1e-10", "-ts_atol", "1e-10"], False, (1,)),
    ("slidercrank3d", ["-ts_rtol", "1e-7", "-ts_atol", "1e-7"], True, (1,)),
    ("rollingball", ["-end", "10", "-ts_rtol", "1e-8", "-ts_atol", "1e-8"], True, (1,)),
    ("chain", ["-n", "40", "-end", "2", "-ts_rtol", "1e-5", "-ts_atol", "1e-5"], True, (1, 2)),
    ("flyball", [], True, (1,)),
]


class Case:
    def __init__(self, name, options, scene, ranks):
        self.name, self.scene, self.ranks = name, scene, ranks
        self.options = options
        self.start = os.path.join(directory, "%s-%d" % (name, ranks))
        began = time.monotonic()
        self.out = run(self.line("whole"))
        self.seconds = time.monotonic() - began
        self.counters = summary(self.out)
        self.every = max(1, int(self.counters["steps"]) // 40)

    def line(self, kind, *more):
        line = command(bin, self.name, self.ranks) + self.options + ["-ts_view_solution", "binary:%s-%s.state" % (self.start, kind), "-viewer_binary_skip_info"]
        if self.scene:
            line += ["-scene_balance", "%s-%s.balance" % (self.start, kind)]
        return line + [str(word) for word in more]

    def file(self, kind, end):
        return "%s-%s.%s" % (self.start, kind, end)


def descendants(pid):
    """Processes below this one"""
    children = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                with open("/proc/%s/stat" % entry) as f:
                    parent = int(f.read().rsplit(")", 1)[1].split()[1])
            except OSError:
                continue
            children.setdefault(parent, []).append(int(entry))
    found, todo = [], [pid]
    while todo:
        below = children.get(todo.pop(), [])
        found += below
        todo += below
    return found


def kill(process, everybody):
    ranks = descendants(process.pid) or [process.pid]
    for pid in ranks if everybody else [chance.choice(ranks)]:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
    try:
        process.wait(timeout=60)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def disturbed(case):
    """One run, killed up to three times; how often, and from how many checkpoints it went on"""
    checkpoint = case.file("killed", "checkpoint")
    for end in ("checkpoint", "checkpoint.part", "state", "balance"):
        if os.path.exists(case.file("killed", end)):
            os.remove(case.file("killed", end))
    kills = resumes = 0
    while True:
        line = case.line("killed", "-ts_hhtdae_checkpoint", checkpoint, "-ts_hhtdae_checkpoint_every", case.every)
        if os.path.exists(checkpoint):
            line += ["-ts_hhtdae_resume", checkpoint]
            resumes += 1
        process = subprocess.Popen(line, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=surroundings(line))
        try:
            out, err = process.communicate(timeout=chance.random() * 1.1 * case.seconds if kills < 3 else 300)
        except subprocess.TimeoutExpired:
            kills += 1
            kill(process, chance.random() < 0.5)
            process.communicate()
            continue
        check(process.returncode == 0, "%s\n%s\n%s" % (" ".join(line), out[-2000:], err[-2000:]))
        break
    check(summary(out) == case.counters, "%s: other counters after %d kills:\n%s\n%s" % (case.name, kills, summary(out), case.counters))
    check(content(case.file("killed", "state")) == content(case.file("whole", "state")), "%s: other bits after %d kills" % (case.name, kills))
    if case.scene:
        check(content(case.file("killed", "balance")) == content(case.file("whole", "balance")), "%s: another balance after %d kills" % (case.name, kills))
    return kills, resumes


cases = [Case(name, options, scene, n) for name, options, scene, ranks in RUNS for n in ranks if os.path.exists(os.path.join(bin, name))]
check(cases, "there are no programs in " + bin)
for case in cases:
    print("%-16s %d ranks: %s steps, %.2f s" % (case.name, case.ranks, case.counters["steps"], case.seconds), flush=True)
total = [0, 0, 0, 0]
for number in range(count):
    case = cases[number % len(cases)]
    kills, resumes = disturbed(case)
    total = [total[0] + 1, total[1] + (case.ranks > 1), total[2] + kills, total[3] + resumes]
check(count < 10 or (total[2] and total[3]), "no run was killed, or none went on from a checkpoint")
print("%d runs, %d of them on two ranks: %d kills, %d resumptions, all with the bits of the undisturbed run (seed %d)" % (*total, seed))

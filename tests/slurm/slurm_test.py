#!/usr/bin/env python3
"""samples/slurm on a real Slurm, whose jobs are stopped and killed midway.

    tests/slurm/slurm_test.py build/release [--models 400] [--pictures 500] [--keep FOLDER]

Not run by CTest: it takes some minutes, root, and Debian's packages slurmctld, slurmd and munge. It starts
munged, slurmctld and slurmd of its own, in namespaces where nobody else sees them and with which they end,
and submits two arrays of 8: a list of models and a path of pictures. While they run, one shard is cancelled,
one is put back into the queue, one is told that its time is up, an stx and its worker are killed by SIGKILL,
and the whole node dies (slurmd, its steps and their processes). Then the same is submitted again. Each output
is there once, whole, with the bytes that one machine makes, nothing else is left, and the joined reports name
each input once and exactly those as missing that no shard did.
"""
import argparse
import ctypes
import fcntl
import json
import math
import os
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

SHARDS = 8
CONVERT = ["--views", "ring:6", "--size", "96x96"]
RENDER = ["--size", "160x120", "--elevation", "20", "--backend", "cpu"]
# Of processors that this node says to have: more than it has, so that shards overlap.
PROCESSORS = 4
DEADLINE = 900
SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

CONF = """ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
# A requeued job waits until what it was allowed to run by has expired, 120 s as a rule.
AuthInfo=socket={top}/munge/socket,cred_expire=5
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
StateSaveLocation={top}/state
SlurmdSpoolDir={top}/spool
SlurmctldPidFile={top}/slurmctld.pid
SlurmdPidFile={top}/slurmd.pid
SlurmctldLogFile={top}/slurmctld.log
SlurmdLogFile={top}/slurmd.log
SlurmdParameters=config_overrides
SlurmctldTimeout=30
SlurmdTimeout=20
KillWait=3
SchedulerParameters=batch_sched_delay=0,sched_interval=2,requeue_delay=0
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
NodeName={host} NodeAddr=127.0.0.1 CPUs={processors} RealMemory=1000 State=UNKNOWN
PartitionName=all Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


def fail(text):
    sys.exit(f"FAILED: {text}")


def expect(good, text):
    if not good:
        fail(text)


def run(*command, codes=(0,), **more):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
    expect(done.returncode in codes, f"{' '.join(map(str, command))} ended with {done.returncode}:\n{done.stdout[-3000:]}")
    return done.stdout


def until(what, ready, seconds=DEADLINE, every=0.1):
    end = time.monotonic() + seconds
    while not ready():
        if time.monotonic() > end:
            fail(f"{what}: not within {seconds} s\n{queue()}")
        time.sleep(every)


def queue():
    return subprocess.run(["squeue", "--all"], capture_output=True, text=True).stdout


def processes(*words):
    """Process ids, the parent of each before it, of those whose command line has all words."""
    found = []
    for name in os.listdir("/proc"):
        if name.isdigit():
            try:
                with open(f"/proc/{name}/cmdline", "rb") as file:
                    line = file.read().replace(b"\0", b" ").decode("utf-8", "replace")
            except OSError:
                continue
            if all(word in line for word in words):
                found.append(int(name))
    return sorted(found)


def parent_of(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:
        return int(file.read().rpartition(")")[2].split()[1])


def children_of(roots):
    parents = {}
    for name in os.listdir("/proc"):
        if name.isdigit():
            try:
                parents[int(name)] = parent_of(name)
            except OSError:
                continue
    found = set(roots)
    while True:
        more = {p for p, parent in parents.items() if parent in found} - found
        if not more:
            return found
        found |= more


def send(pid, number):
    """Whether the process is there to get a signal."""
    try:
        os.kill(pid, number)
        return True
    except ProcessLookupError:
        return False


def kill_all(pids):
    for pid in pids:
        send(pid, signal.SIGKILL)


class Cluster:
    """munged, slurmctld and one slurmd, in `top`."""

    def __init__(self, top):
        self.top = top
        for name in ("munge", "state", "spool"):
            os.mkdir(os.path.join(top, name))
        munge = os.path.join(top, "munge")
        with open(os.path.join(munge, "key"), "wb") as file:
            file.write(os.urandom(1024))
        os.chmod(os.path.join(munge, "key"), 0o400)
        for name in (munge, os.path.join(munge, "key")):
            shutil.chown(name, "munge", "munge")
        os.chmod(top, 0o755)
        os.chmod(munge, 0o755)
        conf = os.path.join(top, "slurm.conf")
        with open(conf, "w", encoding="ascii") as file:
            file.write(CONF.format(top=top, host=socket.gethostname().split(".")[0], processors=PROCESSORS))
        os.environ["SLURM_CONF"] = conf
        self.start("munged", ["runuser", "-u", "munge", "--", "munged", "--foreground", f"--socket={munge}/socket",
                              f"--key-file={munge}/key", f"--pid-file={munge}/pid", f"--seed-file={munge}/seed"])
        until("munged", lambda: os.path.exists(f"{munge}/socket"), 20)
        self.start("slurmctld", ["slurmctld", "-D"])
        self.start_node()
        until("an idle node", lambda: "idle" in subprocess.run(["sinfo", "-h", "-o", "%T"], capture_output=True,
                                                              text=True).stdout, 60)

    def start(self, name, command):
        with open(os.path.join(self.top, name + ".out"), "ab") as out:
            return subprocess.Popen(command, stdout=out, stderr=out, stdin=subprocess.DEVNULL)

    def start_node(self):
        self.node = self.start("slurmd", ["slurmd", "-D"])

    def node_dies(self):
        """As by a power cut: no process of the node is left. It comes back after two seconds."""
        kill_all(children_of([self.node.pid] + processes("slurmstepd")))
        self.node.wait()
        time.sleep(2)
        self.start_node()


def model(rng):
    """A closed lump of 2 x 12 x 24 triangles."""
    rings, sides = 12, 24
    lump = [[rng.uniform(0.7, 1.0) for _ in range(sides)] for _ in range(rings + 1)]
    lines = []
    for i in range(rings + 1):
        for j in range(sides):
            a, b, r = math.pi * i / rings, 2 * math.pi * j / sides, lump[i][j if 0 < i < rings else 0]
            lines.append(f"v {r * math.sin(a) * math.cos(b):.4f} {r * math.cos(a):.4f} {r * math.sin(a) * math.sin(b):.4f}")
    at = lambda i, j: i * sides + j % sides + 1
    for i in range(rings):
        for j in range(sides):
            lines.append(f"f {at(i, j)} {at(i, j + 1)} {at(i + 1, j + 1)} {at(i + 1, j)}")
    return "\n".join(lines) + "\n"


def tree(folder):
    found = {}
    for where, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(where, name)
            with open(path, "rb") as file:
                found[os.path.relpath(path, folder)] = file.read()
    return found


def entries(log, kind):
    """Of the joined report: the entries, by index."""
    if kind == "convert":
        with open(os.path.join(log, "all.jsonl"), encoding="utf-8") as file:
            found = [json.loads(line) for line in file]
    else:
        with open(os.path.join(log, "all.json"), encoding="utf-8") as file:
            found = json.load(file)["views"]
    expect(len({e["index"] for e in found}) == len(found), "the joined report names an index twice")
    return {e["index"]: e for e in found}


def done(job):
    """Whether a job and all its array's tasks have ended."""
    shown = subprocess.run(["squeue", "-h", "-j", str(job)], capture_output=True, text=True)
    return shown.returncode == 0 and not shown.stdout.strip() or "Invalid job id" in shown.stderr


class Pace(threading.Thread):
    """Stops every stx as soon as `most` outputs are there, so that what is to happen then happens to a job that is
    still at work, however fast the machine is."""

    def __init__(self, folder):
        super().__init__(daemon=True)
        self.folder, self.most, self.over, self.spared, self.held = folder, 0, False, None, set()
        self.lock = threading.Lock()
        self.start()

    def count(self):
        """Whole outputs that are there."""
        return sum(not n.startswith(".") for n in os.listdir(self.folder)) if os.path.isdir(self.folder) else 0

    def run(self):
        while not self.over:
            with self.lock:
                if not self.over and self.count() >= self.most:
                    self.hold()
            time.sleep(0.005)

    def hold(self):
        spared = of_shard(self.spared) if self.spared else set()
        for pid in children_of(processes("--shard", "--skip-existing")) - self.held - spared:
            if send(pid, signal.SIGSTOP):
                self.held.add(pid)

    def let(self, shard):
        """Lets this shard alone go on: what is stopped hears no signal."""
        with self.lock:
            self.spared = shard
            for pid in of_shard(shard) & self.held:
                send(pid, signal.SIGCONT)
                self.held.discard(pid)

    def go_on(self, most):
        """Lets all run until `most` outputs are there; None: to the end."""
        with self.lock:
            self.most, self.over, self.spared = most, most is None, None
            for pid in self.held:
                send(pid, signal.SIGCONT)
            self.held.clear()


def of_shard(shard):
    return children_of(processes(f"--shard {shard}/{SHARDS} "))


def submit(work, kind, source, pattern, options):
    out = run(os.path.join(SOURCE, "samples/slurm/submit"), kind, source, pattern, str(SHARDS), *options, cwd=work)
    return out.split()


def disturb(cluster, job, pace, total):
    """Everything that happens to clusters, at moments told by how much is done. Gives the cancelled shard."""

    def stx_of():
        """A shard that runs stx now: its number and the process."""
        for pid in processes("--shard", "--skip-existing"):
            with open(f"/proc/{pid}/cmdline", "rb") as file:
                words = file.read().split(b"\0")
            if b"--shard" in words:
                return int(words[words.index(b"--shard") + 1].split(b"/")[0]), pid
        return None

    def at(share, what, act):
        pace.go_on(math.ceil(share * total))
        until(f"{share:.0%} of the outputs", lambda: pace.count() >= pace.most or done(job))
        while True:
            expect(not done(job), f"the job was done before: {what}")
            running = stx_of()
            # The shard may have ended since, or be about to start; then it is another's turn.
            if running:
                pace.let(running[0])
            if running and act(*running) is not False:
                print(f"  at {pace.count()} of {total}: {what} (shard {running[0]})", flush=True)
                return running[0]
            time.sleep(0.1)

    def slurm(*command):
        return subprocess.run(command, capture_output=True).returncode == 0

    cancelled = at(0.08, "scancel", lambda k, _: slurm("scancel", f"{job}_{k}"))
    until("the end of the cancelled shard", lambda: not processes(f"{cancelled}/{SHARDS}"), 60)
    at(0.15, "kill -9 of stx", lambda _, pid: kill_all([pid]))
    at(0.22, "kill -9 of its newest process", lambda _, pid: kill_all([max(children_of([pid]))]))
    # What --signal=B:USR1@60 does; scancel would send it again and again while the job is put back, and take a minute.
    at(0.30, "its time is up", lambda _, pid: send(parent_of(pid), signal.SIGUSR1))
    at(0.40, "scontrol requeue", lambda k, _: slurm("scontrol", "requeue", f"{job}_{k}"))
    at(0.55, "the node dies", lambda _k, _p: cluster.node_dies())
    pace.go_on(None)
    return cancelled


def check(work, log, kind, total, names, outputs, truth, cancelled=None):
    """After the verify job: what it said, and that it is so."""
    with open(os.path.join(log, "verify.log"), encoding="utf-8") as file:
        said = file.read()
    what = "inputs" if kind == "convert" else "pictures"
    counts = re.findall(rf"(\d+) {what}: (\d+) done, (\d+) skipped, (\d+) failed, (\d+) missing", said)
    expect(counts, f"verify.log does not count:\n{said}")
    all_of, ok, skipped, failed, missing = map(int, counts[-1])
    reported = entries(log, kind)
    folder = os.path.join(work, os.path.dirname(outputs[0]))
    there = tree(folder)
    expect(all_of == total and failed == 0 and ok + skipped + missing == total and len(reported) == ok + skipped,
           f"the counts do not add up: {counts[-1]}, {len(reported)} entries")
    for index, entry in reported.items():
        expect(entry["output"] == outputs[index] and (kind == "render" or entry["input"] == names[index]),
               f"entry {index} is of {entry}")
        expect(os.path.basename(outputs[index]) in there, f"'{outputs[index]}' is reported and not there")
    lost = [i for i in range(total) if i not in reported]
    if kind == "convert":
        rest = open(os.path.join(log, "rest.txt"), encoding="utf-8").read().split()
        expect(rest == [names[i] for i in lost], "rest.txt is not what is missing")
    expect(len(lost) == missing, "the number of missing is wrong")
    # Whole or absent, whatever happened.
    for name, content in there.items():
        expect(name.startswith(".stx-tmp-") and cancelled or truth.get(name) == content, f"'{name}' is not what one machine makes")
    ended = re.findall(r"== \d+ outputs looked at, ends with (\d+)", said)
    if cancelled is None:
        expect(missing == 0 and ended[-1] == "0" and there.keys() == truth.keys(),
               f"not all is there: {counts[-1]}, verify ended with {ended}, {len(there)} of {len(truth)} files")
    else:
        of_shard = [i for i in range(total) if (i % SHARDS == cancelled - 1 if kind == "convert" else
                                                total * (cancelled - 1) // SHARDS <= i < total * cancelled // SHARDS)]
        expect(set(lost) <= set(of_shard) and lost, f"missing is {lost}, of the cancelled shard {of_shard}")
        expect(ended[-1] == "7", f"verify ended with {ended}; 7 is expected")
    print(f"  {ok} done, {skipped} skipped, {failed} failed, {missing} missing; {len(there)} files, all as one machine makes them",
          flush=True)


def campaign(cluster, work, kind, source, pattern, options, total, names, outputs, truth):
    start = time.monotonic()
    folder = os.path.join(work, os.path.dirname(outputs[0]))
    log = folder + ".stx"
    pace = Pace(folder)
    job, verify = submit(work, kind, source, pattern, options)
    print(f"{kind}: job {job}, {total} outputs, {SHARDS} shards", flush=True)
    cancelled = disturb(cluster, job, pace, total)
    until("the end of the job and of verify", lambda: done(job) and done(verify))
    check(work, log, kind, total, names, outputs, truth, cancelled)
    os.remove(os.path.join(log, "verify.log"))
    job, verify = submit(work, kind, source, pattern, options)
    print(f"  submitted again: job {job}", flush=True)
    until("the end of the second job and of verify", lambda: done(job) and done(verify))
    check(work, log, kind, total, names, outputs, truth)
    print(f"{kind}: right after {time.monotonic() - start:.0f} s", flush=True)


def inside(args, top):
    # An own network: ports are free, and nobody outside can reach the daemons.
    with socket.socket() as s:
        fcntl.ioctl(s, 0x8914, struct.pack("16sh14x", b"lo", 0x1 | 0x40))  # SIOCSIFFLAGS: up, running
        # getaddrinfo() takes a machine that has 127.0.0.1 alone for one without a network. SIOCSIFADDR.
        fcntl.ioctl(s, 0x8916, struct.pack("16shH4s8x", b"lo:1", socket.AF_INET, 0, socket.inet_aton("127.0.0.2")))
    ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)  # PR_SET_CHILD_SUBREAPER
    stx = os.path.join(args.build, "bin/stx")
    os.environ["PATH"] = os.path.join(args.build, "bin") + ":" + os.environ["PATH"]
    os.environ["STX_RETRY_SECONDS"] = "1"
    work = os.path.join(top, "work")
    os.makedirs(os.path.join(work, "models"))
    rng = random.Random(1)
    names = [f"models/m{i:03d}.obj" for i in range(args.models)]
    for name in names:
        with open(os.path.join(work, name), "w", encoding="ascii") as file:
            file.write(model(rng))
    with open(os.path.join(work, "list.txt"), "w", encoding="ascii") as file:
        file.write("\n".join(names) + "\n")
    for folder in ("one", "truth"):
        os.mkdir(os.path.join(work, folder))
    start = time.monotonic()
    run(stx, "convert", "@list.txt", "-o", "one/{stem}.mp4", "--jobs", "2", *CONVERT, cwd=work)
    run(stx, "convert", names[0], "-o", "scene.exr", "--views", "sphere:16", "--size", "256x256", cwd=work)
    orbit = ["--orbit", str(args.pictures)] + RENDER
    run(stx, "render", "scene.exr", "-o", "truth/p_%05d.png", *orbit, cwd=work)
    print(f"one machine: {time.monotonic() - start:.0f} s", flush=True)
    cluster = Cluster(top)
    print(run("sinfo", "--version").strip(), flush=True)
    campaign(cluster, work, "convert", "list.txt", "many/{stem}.mp4", CONVERT, args.models, names,
             [f"many/m{i:03d}.mp4" for i in range(args.models)], tree(os.path.join(work, "one")))
    campaign(cluster, work, "render", "scene.exr", "path/p_%05d.png", orbit, args.pictures, None,
             [f"path/p_{i:05d}.png" for i in range(args.pictures)], tree(os.path.join(work, "truth")))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--models", type=int, default=400)
    parser.add_argument("--pictures", type=int, default=500)
    parser.add_argument("--keep", default="", help="an empty folder to work in, that stays")
    parser.add_argument("--inside", default="", help=argparse.SUPPRESS)
    args = parser.parse_args()
    args.build = os.path.abspath(args.build)
    if args.inside:
        inside(args, args.inside)
        return 0
    if os.geteuid() != 0:
        print("SKIPPED: only root can start the daemons and make namespaces")
        return 77
    for tool in ("slurmctld", "slurmd", "sbatch", "munged", "unshare", "runuser"):
        if not shutil.which(tool, path=os.environ["PATH"] + ":/usr/sbin:/sbin"):
            print(f"SKIPPED: {tool} is not here; packages slurmctld, slurmd, slurm-client, munge, util-linux")
            return 77
    os.environ["PATH"] += ":/usr/sbin:/sbin"
    with tempfile.TemporaryDirectory(prefix="stx-slurm-") as own:
        top = os.path.abspath(args.keep) if args.keep else own
        command = ["unshare", "--mount", "--pid", "--net", "--fork", "--kill-child", "--mount-proc", sys.executable,
                   os.path.abspath(__file__), args.build, "--models", str(args.models), "--pictures", str(args.pictures),
                   "--inside", top]
        return subprocess.run(command).returncode


if __name__ == "__main__":
    sys.exit(main())
